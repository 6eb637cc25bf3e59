"""Accelerations that drives can bear: figures computed by hand, and their effect on a robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.config.robot.config import Posture, RobotConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel
from cellwright.config.robot.robots import read_robot_config
from cellwright.config.robot.urdf import read_urdf
from cellwright.robot.checks.motion import (
    INERTIA_SHARE,
    RAMP,
    bearable_accelerations,
    check_motion,
    propose_accelerations,
)
from cellwright.robot.checks.rig import MotionReport, Rig
from cellwright.robot.node import RobotNode
from cellwright.util.pose import Pose
from tests.config.robot import torso_robot


def pendulum(*efforts: float, mass: float = 2.0, length: float = 0.5) -> RobotConfig:
    """Point masses on rods, one after the other; all axes are parallel."""
    links = {"base": Link("base")}
    joints = []
    for number, effort in enumerate(efforts):
        name, parent = f"link{number}", tuple(links)[-1]
        links[name] = Link(name, Inertial(mass, Pose((length, 0.0, 0.0)), (1e-6, 1e-6, 1e-6, 0, 0, 0)))
        origin = Pose((length if number else 0.0, 0.0, 0.0))
        limits = Limits(-0.001, 0.001, effort, 3.0)  # almost no range: all postures are equal
        joints.append(Joint(f"j{number}", JointType.REVOLUTE, parent, name, origin, (0.0, 1.0, 0.0), limits))
    return RobotConfig(RobotModel("rods", "base", links, tuple(joints)), "rods", Path("rods"), Path("rods.urdf"))


def find_accelerations(config: RobotConfig) -> dict[str, float]:
    rig = Rig(RobotNode(config))
    try:
        return bearable_accelerations(rig)
    finally:
        rig.node.close()


def test_single_joint_gets_acceleration_of_effort_over_inertia() -> None:
    found = find_accelerations(pendulum(4.0))
    assert found["j0"] == pytest.approx(INERTIA_SHARE * 4.0 / (2.0 * 0.5**2), rel=1e-3)


def test_strong_joint_gets_acceleration_limited_by_ramp_time() -> None:
    assert find_accelerations(pendulum(1e6))["j0"] == pytest.approx(3.0 / RAMP)


def test_weak_next_joint_lowers_acceleration_of_previous_one() -> None:
    """Stretched out, 1 rad/s^2 of the first joint takes m l 2l of the second one's effort."""
    weak, strong = find_accelerations(pendulum(100.0, 1.0)), find_accelerations(pendulum(100.0, 100.0))
    assert weak["j0"] < INERTIA_SHARE * 1.0 / (2.0 * 0.5 * 1.0)
    assert weak["j0"] < 0.1 * strong["j0"]


def test_head_proposal_has_one_figure_per_axis() -> None:
    config = replace(pendulum(4.0, 4.0), head=Posture(("j0", "j1"), (0.0, 0.0)), head_axes=(1, 2))
    rig = Rig(RobotNode(config))
    proposal = propose_accelerations(rig, ("j0",))
    rig.node.close()
    assert proposal.startswith(
        "drives reach their effort limits; add to the configuration: head.max_acceleration: [1, "
    )
    assert proposal.count(",") == 2


FILE = """\
urdf_path: robot.urdf
waist: {joint_index: [torso_joint1, torso_joint2, torso_joint3, torso_joint4], rest_j_pos: [0, 0, 0, 0]BOUND}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder_path = tmp_path_factory.mktemp("torso")
    torso_robot.write(folder_path, torso_robot.urdf())
    return folder_path


def check(folder: Path, bound: str = "") -> MotionReport:
    path = folder / "vr_configs.yml"
    path.write_text(FILE.replace("BOUND", bound))
    return check_motion(RobotNode(read_robot_config(path, pytest.fail)))


@pytest.mark.slow
def test_proposed_accelerations_end_overshoot_and_stray(folder: Path) -> None:
    """A torso that carries two arms goes 40 % and more beyond a step, and is pushed away when its next joint moves."""
    before = {finding.what: finding for finding in check(folder).findings}
    beyond, strays = before["largest overshoot"], before["largest motion of other joints"]
    assert not beyond.passed
    assert not strays.passed
    assert beyond.worst > 40.0
    assert (beyond.where, strays.where) == ("torso_joint1", "torso_joint1, while torso_joint2 moves")
    assert strays.worst > 80.0
    name, _, figures = beyond.remedy.rpartition("configuration: ")[2].partition(": ")
    assert (name, strays.remedy) == ("waist.max_acceleration", "")
    after = check(folder, f", max_acceleration: {figures}")
    assert after.passed
    remaining = {finding.what: finding.worst for finding in after.findings}
    assert remaining["largest overshoot"] < 2.0
    assert remaining["largest motion of other joints"] < 10.0


@pytest.mark.slow
def test_joints_without_group_are_proposed_one_by_one(folder: Path) -> None:
    robot = read_urdf(folder / "robot.urdf", warn=pytest.fail)
    config = RobotConfig(robot, "plain", folder / "robot.urdf", folder / "robot.urdf")
    (remedy,) = [finding.remedy for finding in check_motion(RobotNode(config)).findings if finding.remedy]
    assert "max_acceleration of a group with torso_joint1 " in remedy
