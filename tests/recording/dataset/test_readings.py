"""Readings of cells and nodes: names, measured values, and targets after all limits."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import cellwright
from cellwright import Cell, RobotNode, load_trial
from cellwright.middleware.messages.conversions import joint_state
from cellwright.recording.dataset.readings import cameras_of, readings_of
from cellwright.util.errors import UnknownNameError
from tests.cell.robot_cells import tandem_cell
from tests.support.cells import run


@pytest.fixture(name="node")
def made_node() -> Iterator[RobotNode]:
    node = RobotNode(cellwright.load_robot("tandem"))
    yield node
    node.close()


def test_arm_has_its_channels_and_setpoints() -> None:
    cell = Cell(load_trial("lesson"))
    readings = readings_of(cell, 20)
    assert readings.robot == "cellwright_ur10"
    assert (readings.names[0], readings.names[-1]) == ("linear_arm_actuator_joint", "suction")
    first = readings.measured()
    cell.arms["arm"].steer([first[0] + 0.1, *first[1:7]], 50_000_000)
    run(cell, 0.05)
    assert readings.executed() == pytest.approx([first[0] + 0.1, *first[1:7], 0.0])
    assert first[0] < readings.measured()[0] < first[0] + 0.1


def test_robot_of_a_cell_has_its_limited_targets() -> None:
    cell = Cell(tandem_cell())
    readings = readings_of(cell, 20)
    assert readings.robot == "cellwright_tandem"
    lift = readings.names.index("tandem/lift")
    commander = cell.robots["tandem"].commander
    commander.limiter.desired[commander.numbers["lift"]] = 0.2
    assert readings.executed()[lift] == commander.applied[commander.numbers["lift"]] == 0.0
    cell.bus.publish("/left/joint_cmd", joint_state(["lift"], [0.2]))
    run(cell, 0.1)
    assert readings.executed()[lift] == pytest.approx(0.2)
    assert 0.0 < readings.measured()[lift] < 0.2


def test_node_has_joints_and_shares_of_its_grippers(node: RobotNode) -> None:
    readings = readings_of(node, 20)
    assert (readings.robot, readings.names[0]) == ("cellwright_tandem", "lift")
    assert readings.names[-2:] == ("gripper_right", "gripper_left")
    assert (readings.units[0], readings.units[-1]) == ("m", "")
    node.bus.publish("/io_teleop/joint_cmd", joint_state(["lift"], [0.2]))
    node.bus.publish("/io_teleop/target_gripper_status", joint_state(["", ""], [1.0, 0.25]))
    node.simulation.step_until(50_000_000)
    assert readings.executed()[0] == pytest.approx(0.2)
    assert readings.executed()[-2:] == pytest.approx([1.0, 0.25])
    assert all(0.0 <= each < 1.0 for each in readings.measured()[-2:])


def test_unknown_camera_is_refused_with_the_known_ones() -> None:
    cell = Cell(load_trial("pick_from_bin"))
    assert [camera.name for camera in cameras_of(cell, ("wrist", "overhead"))] == ["wrist", "overhead"]
    with pytest.raises(UnknownNameError, match="unknown colour camera 'overhed'; did you mean overhead"):
        cameras_of(cell, ("overhed",))
