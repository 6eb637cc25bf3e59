"""Controller of a robot, in a world with other names than its own; `test_node.py` has the node's own world."""

from fractions import Fraction

import pytest

from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import bind
from cellwright.middleware.messages.conversions import joint_state
from cellwright.robot.controller import Place, RobotController
from cellwright.robot.interface import rows_in_cell
from cellwright.robot.model import TIMESTEP, build_links, build_robot
from cellwright.robot.safety import SafetySettings
from tests.robot.robots import two_arms


def test_controller_hears_topics_of_its_namespace_and_names_it_in_remedies() -> None:
    config = two_arms()
    world = build_robot(config, timestep=TIMESTEP)
    simulation = Simulation(world.stepping, timestep=Fraction(1, 240), first_pose=world.set_initial_posture)
    clock = simulation.clock
    bus = Bus(clock.read, lambda _line: None)
    place = Place(bus, clock.read, clock.message_time, lambda: clock.offset, namespace="left")
    controller = RobotController(config, build_links(config), place, SafetySettings(start_disabled=True))
    controller.add_devices(simulation)
    bind(bus, simulation, rows_in_cell(config, namespace="left"), controller.handlers({}))
    simulation.reset()
    bus.publish("/left/joint_cmd", joint_state(["shoulder_right"], [0.3], time=0))
    simulation.step_until(100_000_000)
    assert controller.commander.ignored == 1
    assert "call /left/set_enabled" in controller.commander.why_ignored
    controller.commander.set_enabled(True)
    bus.publish("/left/joint_cmd", joint_state(["shoulder_right"], [0.3], time=0))
    simulation.step_until(3_000_000_000)
    number = controller.commander.numbers["shoulder_right"]
    assert controller.driver.read().positions[number] == pytest.approx(0.3, abs=1e-3)
    assert controller.commander.sources[0] == "/left/joint_cmd"
