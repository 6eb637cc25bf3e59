"""Grippers of a cell by the names of their arms."""

import pytest

from cellwright import Cell
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.devices.grippers import grippers_of
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.config.trial.gear2017 import load_trial
from tests.cell.arm_cells import ARMS, TWO_UR5, finger_cell


def test_each_arm_has_the_gripper_of_its_tool() -> None:
    text = TWO_UR5.replace("arm2: {{", "arm2: {{tool: {{kind: parallel}}, ").format(model=ARMS / "ur5.urdf")
    cell = Cell(load_trial(text=text).trial)
    assert [(name, type(each), each.name) for name, each in cell.grippers.items()] == [
        ("arm1", VacuumGripper, "gripper_arm1"),
        ("arm2", FingerGripper, "gripper_arm2"),
    ]


def test_arm_without_a_tool_has_none() -> None:
    cell = Cell(finger_cell("{kind: none}"))
    assert grippers_of(cell.trial, cell.parts) == {}


def test_points_at_parts_are_those_of_cup_and_pads() -> None:
    cup, pads = (Cell(finger_cell(f"{{kind: {kind}, length: 0.12}}")) for kind in ("vacuum", "parallel"))
    for cell, link, height in ((cup, "vacuum_gripper_link", 0.0), (pads, "gripper_palm", 0.099)):
        (tool,) = cell.scene_metadata(lambda body: body)["tools"]
        assert cell.simulation.model.body(tool[0]).name == f"arm/{link}"
        assert tool[1] == pytest.approx([0.0, 0.0, height], abs=0.006)
