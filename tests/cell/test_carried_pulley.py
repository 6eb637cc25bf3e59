"""A flipped pulley that a finals team's program carries past the arm's base: nothing solid is in its way."""

import json
from typing import Any

import pytest

from cellwright import Cell, load_trial
from cellwright.cell.kitting.kit_score import KitScore
from cellwright.clients.client import trajectory_message
from cellwright.config.trial.catalogue import find_trial
from cellwright.middleware.messages import osrf_gear
from cellwright.middleware.messages.std_srvs import TriggerRequest
from tests.conftest import DATA

RECORDED = json.loads((DATA / "final05_pulley.json").read_text())
PROGRAM = "/program"
KIT = "order_0_kit_0"
CARRIED = 18766
"""Tick of the command that takes the flipped pulley along the rail."""
ARRIVED = RECORDED["delivery"][0][0]
"""Tick at which it is there."""
NEAR = 0.009
"""Largest distance [m; rad] of each joint from its goal with which the program went on."""


def execute(cell: Cell, command: Any) -> None:
    """Give a recorded command to the cell."""
    if command == "start":
        assert cell.bus.call("/ariac/start_competition", TriggerRequest(), node=PROGRAM).success
    elif isinstance(command, bool):
        cell.bus.call("/ariac/gripper/control", osrf_gear.VacuumGripperControlRequest(enable=command), node=PROGRAM)
    else:
        time, *positions = command
        message = trajectory_message(RECORDED["joints"], [positions], [time])
        cell.bus.publish("/ariac/arm/command", message, node=PROGRAM)


def step_to(cell: Cell, tick: int) -> None:
    while cell.simulation.clock.tick < tick:
        cell.step()


def farthest_joint(cell: Cell, goal: list[float]) -> float:
    """Return the largest distance [m; rad] of a joint from its goal."""
    data, model = cell.simulation.data, cell.world.model
    return max(
        abs(float(data.qpos[model.joint(name).qposadr[0]]) - value)
        for name, value in zip(RECORDED["joints"], goal, strict=True)
    )


def kit_of(cell: Cell) -> KitScore:
    (kit,) = [kit for order in cell.competition.score().orders for kit in order.kits if kit.kit_type == KIT]
    return kit


@pytest.mark.slow
def test_pulley_carried_past_base_arrives_and_completes_kit() -> None:
    cell = Cell(load_trial(find_trial("final05"), find_trial("kitter_sensors")))
    carried = next(command for tick, command in RECORDED["commands"] if tick == CARRIED)
    delivered = sorted([*RECORDED["commands"], *RECORDED["delivery"]], key=lambda each: each[0])
    for tick, command in delivered:
        step_to(cell, tick)
        if tick == ARRIVED:
            assert cell.gripper is not None
            assert cell.gripper.part == "bin5|pulley_part_2"
            assert cell.parts.pose(cell.parts.part(cell.gripper.part)).rotate((0.0, 0.0, 1.0))[2] < -0.99
            assert farthest_joint(cell, carried[1:]) < NEAR
        execute(cell, command)
    step_to(cell, delivered[-1][0] + 500)
    request = osrf_gear.AGVControlRequest(kit_type=KIT)
    assert cell.bus.call("/ariac/agv1", request, node=PROGRAM).success
    step_to(cell, cell.simulation.clock.tick + 500)
    kit = kit_of(cell)
    assert kit.is_submitted
    assert kit.total == 12.0, kit
