"""Figures of the QingLong against the table of its indices, as PyBullet numbers and reports them."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from tools.qinglong.urdf import figures

TABLE: list[dict[str, Any]] = json.loads(
    (Path(__file__).parents[2] / "data" / "qinglong_joints.json").read_text("utf-8")
)
TURNED = ("rh_LFJ5", "lh_LFJ5")  # PyBullet gives their axes in another frame


def test_joint_has_index_of_table() -> None:
    robot = figures()
    assert [joint.name for joint in robot.joints] == [row["joint"] for row in TABLE]
    assert robot.joint_indices == {row["joint"]: row["index"] for row in TABLE}
    assert robot.link_indices == {robot.root: -1} | {row["link"]: row["index"] for row in TABLE}


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row["joint"])
def test_joint_figures_equal_table(row: dict[str, Any]) -> None:
    robot = figures()
    joint = robot.joints[row["index"]]
    assert joint.type == row["type"]
    assert robot.link_indices[joint.parent] == row["parent"]
    if row["type"] == "revolute":
        limits = joint.limits
        found = (limits.lower, limits.upper, limits.effort, limits.velocity)
        assert found == pytest.approx([row[key] for key in ("lower", "upper", "effort", "velocity")], abs=1e-5)
        assert math.hypot(*joint.axis) == pytest.approx(1.0, abs=1e-9)
        if joint.name not in TURNED:
            assert list(joint.axis) == row["axis"]
    inertial = robot.links[joint.child].inertial
    assert (1.0 if inertial is None else inertial.mass) == pytest.approx(row["mass"], rel=1e-3)


def test_mass_of_robot_equals_source() -> None:
    """78.74 kg, without the eight links for which the source has no mass."""
    masses = [link.inertial.mass for link in figures().links.values() if link.inertial is not None]
    assert sum(masses) == pytest.approx(78.74, abs=0.01)
    assert len(figures().links) - len(masses) == 8
