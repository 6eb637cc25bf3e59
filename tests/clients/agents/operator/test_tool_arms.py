"""Arms as a person works them, against the bodies of the cell."""

from __future__ import annotations

import pytest

from cellwright import load_trial
from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.device import Device
from cellwright.clients.agents.operator.tool_arms import operated_arms
from cellwright.clients.client.client import Client
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose
from tests.cell.arm_cells import TWO_ON_A_RAIL, TWO_UR5, carried_cell, finger_cell, ur5_cell
from tests.cell.robot_cells import tandem_cell
from tests.support.cells import ARM_ONLY

CELLS = {
    "2017": (ARM_ONLY, {"arm": "vacuum_gripper_link"}),
    "ur5": (ur5_cell(), {"arm": "arm/vacuum_gripper_link"}),
    "two": (ur5_cell(TWO_UR5), {"arm1": "arm1/vacuum_gripper_link", "arm2": "arm2/vacuum_gripper_link"}),
    "rail": (load_text(text=TWO_ON_A_RAIL).trial, {}),
    "fingers": (finger_cell(), {"arm": "arm/tool0"}),
    "robot": (tandem_cell(), {"tandem/right": "tandem/right_tip", "tandem/left": "tandem/left_tip"}),
}


@pytest.mark.parametrize("name", CELLS)
def test_tool_is_where_its_link_is(name: str) -> None:
    trial, links = CELLS[name]
    cell = Cell(trial)
    client = Client.in_process(cell)
    devices = [Device(client, each) for each in operated_arms(client)]
    client.sleep(0.1)
    for device in devices:
        arm = device.operated
        link = links.get(arm.name) or (arm.arm.holder if arm.arm is not None else "")
        body = cell.simulation.data.body(link)
        tool = arm.world_T_tool(device.measured())
        assert tool.position == pytest.approx(tuple(body.xpos), abs=2e-3), arm.name
        assert abs(sum(a * b for a, b in zip(tool.quaternion, body.xquat, strict=True))) == pytest.approx(1.0, abs=1e-4)
    assert {each.operated.name for each in devices} >= set(links)


def test_rail_carries_the_arm() -> None:
    (arm,) = operated_arms(Client.in_process(Cell(ARM_ONLY)))
    assert arm.has_rail
    assert arm.joints[0] == "linear_arm_actuator_joint"
    at_0, at_1 = (arm.world_T_tool([rail, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0]) for rail in (0.0, 1.0))
    assert at_1.position == pytest.approx(tuple(Pose((0.0, 1.0, 0.0)).transform(at_0.position)))
    assert len(arm.limits) == 7


def test_arm_on_a_moving_link_has_no_place() -> None:
    places = {arm.name: arm.has_place for arm in operated_arms(Client.in_process(Cell(carried_cell())))}
    assert places == {"gantry": True, "small": False}


def test_cell_without_arms_has_none() -> None:
    assert operated_arms(Client.in_process(Cell(Trial("empty")))) == []
    assert [each.name for each in operated_arms(Client.in_process(Cell(load_trial("reach"))))] == [
        "qinglong/right",
        "qinglong/left",
    ]
