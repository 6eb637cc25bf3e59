"""Robots for tests, with round figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cellwright.config.robot.config import ArmConfig, GripperConfig, Posture, RobotConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, Mimic, RobotModel
from cellwright.util.pose import Pose

REVOLUTE, PRISMATIC, CONTINUOUS = JointType.REVOLUTE, JointType.PRISMATIC, JointType.CONTINUOUS
SPHERICAL, FIXED = JointType.SPHERICAL, JointType.FIXED

ARM = Limits(-2.0, 2.0, effort=80.0, velocity=3.0)
FINGER = Limits(0.0, 0.04, effort=20.0, velocity=0.2)


def _arm(side: str, y: float) -> list[Joint]:
    shoulder, upper, lower, hand = f"torso {side}", f"upper_{side}", f"lower_{side}", f"hand_{side}"
    del shoulder
    return [
        Joint(f"shoulder_{side}", REVOLUTE, "torso", upper, Pose((0.0, y, 0.4)), (0.0, 1.0, 0.0), ARM),
        Joint(f"elbow_{side}", REVOLUTE, upper, lower, Pose((0.3, 0.0, 0.0)), (0.0, 1.0, 0.0), ARM),
        Joint(f"wrist_{side}", REVOLUTE, lower, hand, Pose((0.25, 0.0, 0.0)), (1.0, 0.0, 0.0), ARM),
        Joint(f"finger_{side}", PRISMATIC, hand, f"finger_{side}", Pose((0.1, 0.02, 0.0)), (0.0, 1.0, 0.0), FINGER),
        Joint(
            f"thumb_{side}",
            PRISMATIC,
            hand,
            f"thumb_{side}",
            Pose((0.1, -0.02, 0.0)),
            (0.0, -1.0, 0.0),
            FINGER,
            Mimic(f"finger_{side}"),
        ),
        Joint(f"tip_{side}", FIXED, hand, f"tip_{side}", Pose((0.12, 0.0, 0.0))),
    ]


def two_arms() -> RobotConfig:
    """A robot on a base that can drive: waist, lift, head, a free wheel, a ball joint, two arms with two fingers each.

    Right arm and gripper come first, as in robot configuration files.
    """
    joints = (
        Joint("wheel", CONTINUOUS, "base", "wheel", Pose((0.2, 0.0, 0.0)), (0.0, 1.0, 0.0)),
        Joint("waist", REVOLUTE, "base", "waist", Pose((0, 0, 0.2)), (0.0, 0.0, 1.0), Limits(-1.0, 1.0, 300.0, 2.0)),
        Joint("lift", PRISMATIC, "waist", "torso", Pose((0, 0, 0.3)), (0.0, 0.0, 1.0), Limits(0.0, 0.4, 900.0, 0.5)),
        Joint("head", REVOLUTE, "torso", "head", Pose((0, 0, 0.6)), (0.0, 0.0, 1.0), Limits(-1.5, 1.5, 26.0, 100.0)),
        Joint("antenna", SPHERICAL, "head", "antenna", Pose((0.0, 0.0, 0.2))),
        *_arm("right", -0.2),
        *_arm("left", 0.2),
    )
    light = {
        "head",
        "antenna",
        *(f"{part}_{side}" for part in ("finger", "thumb", "tip") for side in ("right", "left")),
    }
    links = {
        name: Link(name, Inertial(0.2 if name in light else 1.0, Pose((0.05, 0.0, 0.0)), (0.01, 0.01, 0.01, 0, 0, 0)))
        for name in ("base", *(joint.child for joint in joints))
    }
    return RobotConfig(
        robot=RobotModel("two_arms", "base", links, joints),
        name="two_arms",
        path=Path("two_arms.yml"),
        urdf_path=Path("two_arms.urdf"),
        base_pose=Pose((0.0, 0.0, 0.5)),
        arms=(
            ArmConfig(("shoulder_right", "elbow_right", "wrist_right"), "tip_right", (0.5, -1.0, 0.2)),
            ArmConfig(("shoulder_left", "elbow_left", "wrist_left"), "tip_left", (0.5, -1.0, -0.2)),
        ),
        grippers=(GripperConfig(("finger_right",)), GripperConfig(("finger_left",))),
        head=Posture(("head",), (0.1,)),
        head_axes=(2,),
        dorsal=Posture(("lift",), (0.1,)),
        waist=Posture(("waist",), (0.0,)),
        command_links=("tip_right", "tip_left"),
        reference_links=(None, None),
    )


def fixed(config: RobotConfig, link: str = "base") -> RobotConfig:
    """Return the robot with a link fixed to the world."""
    return replace(config, fixed_link=link)


def bare(config: RobotConfig) -> RobotConfig:
    """Return the robot as in a plain URDF: without groups."""
    return RobotConfig(robot=config.robot, name=config.name, path=config.urdf_path, urdf_path=config.urdf_path)
