"""Contacts between links: two arms of a node that are commanded to cross."""

import numpy as np
import pytest

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link
from cellwright.robot.checks.rig import Rig
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.util.pose import Pose
from tests.cell.model.robots import of_joints

APART, LENGTH, THICKNESS = 0.4, 0.5, 0.1
TURNS = Limits(-1.5, 1.5, effort=20.0, velocity=2.0)


def two_bars() -> RobotConfig:
    """Two bars that stand side by side on a plate, and swing towards each other."""
    bar = ModelShape("box", (THICKNESS, THICKNESS, LENGTH), Pose((0.0, 0.0, LENGTH / 2)))
    inertial = Inertial(1.0, Pose((0.0, 0.0, LENGTH / 2)), (0.02, 0.02, 0.002, 0.0, 0.0, 0.0))
    sides = {"left": -APART / 2, "right": APART / 2}
    joints = [
        Joint(side, JointType.REVOLUTE, "plate", f"{side} bar", Pose((x, 0.0, 0.0)), (0.0, 1.0, 0.0), TURNS)
        for side, x in sides.items()
    ]
    links = {f"{side} bar": Link(f"{side} bar", inertial, (bar,)) for side in sides}
    return of_joints(*joints, links=links)


@pytest.mark.parametrize("self_collision", [False, True])
def test_crossing_bars_touch_only_with_self_collision(self_collision: bool) -> None:
    rig = Rig(RobotNode(two_bars(), RobotSettings(self_collision=self_collision)))
    rig.begin()
    rig.send({"left": 1.2, "right": -1.2})
    _, positions = rig.run(3.0)
    last = positions[-1]
    rig.node.close()
    assert np.isfinite(positions).all()
    if not self_collision:
        assert last == pytest.approx([1.2, -1.2], abs=1e-3)
        return
    # they lean on each other where their reaches add up; the share of each is not determined
    assert _reach(last[0]) + _reach(-last[1]) == pytest.approx(APART, abs=0.02)
    assert np.abs(positions[-1] - positions[-240]).max() < 0.05  # and almost stay there


def _reach(angle: float) -> float:
    """Return how far inward [m] a bar reaches that is turned by an angle [rad]."""
    return float(LENGTH * np.sin(angle) + THICKNESS / 2 * np.cos(angle))
