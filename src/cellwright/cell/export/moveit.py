"""MoveIt's package for a cell: its description, and its arms with the limits that their drives follow."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from cellwright.cell.export.description import CellDescription, cell_description
from cellwright.cell.interface.rows import CONTROLLER_NAMES, FOLLOW, FOLLOW_OF_ARM, GRIP, in_namespace
from cellwright.cell.model.build import build_world
from cellwright.config.gripper_links import GripperNames
from cellwright.config.layout.arm_models import home_of, joints_of, laden
from cellwright.config.layout.arms import Arm
from cellwright.config.parsing.findings import Finding
from cellwright.config.parsing.tree import Place
from cellwright.config.robot.model import Limits, RobotModel
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.trial.trial import Trial
from cellwright.mechanism.drives import stiff_drives
from cellwright.mechanism.link_collisions import Progress, unchecked_pairs
from cellwright.middleware.ros2.packages.contents import MOVEIT
from cellwright.middleware.ros2.packages.moveit import PlannedArm, PlannedCell, PlannedFingers, moveit_files
from cellwright.motion.joints import DEFAULT_LIMITS
from cellwright.util.errors import DescriptionError

SPEED_SHARE = 0.7
"""Share of a joint's published speed at which stiff drives follow within 10 mrad."""

_RISE = 0.25  # [s] in which a joint reaches that speed
_EFFORT_SHARE = 0.5  # for the acceleration of the joint alone: the other half is for the motion of the others


def moveit_package(
    trial: Trial,
    package: str = MOVEIT,
    progress: Progress = lambda _share: None,
    places: Mapping[str, Place] = MappingProxyType({}),
) -> dict[str, bytes]:
    """Return every file of MoveIt's package for a trial's cell, by its path in the package.

    Args:
        trial: the trial; its cell has an arm.
        package: name of the package.
        progress: receives the share of the pairs of links that have been searched for contacts.
        places: places of the entries of the cell's file, as `Loaded` has them, for errors.

    Raises:
        DescriptionError: the engine cannot build the cell, or joints have other names in messages than in the
            description.
        ModelFileError: a mesh cannot be read.
        UsageError: convex pieces cannot be made.
    """
    if unfit := [*_misnamed(trial), *_on_robots(trial)]:
        raise DescriptionError([each.at(places, "error") for each in unfit])
    described = cell_description(trial, build_world(trial), package)
    return {**moveit_files(planned_cell(trial, described, progress), package), **described.meshes}


def planned_cell(trial: Trial, described: CellDescription, progress: Progress = lambda _share: None) -> PlannedCell:
    """Return a cell as MoveIt plans in it, given its description."""
    with tempfile.TemporaryDirectory() as folder:
        robot = read_package(Path(folder), described)
        unchecked = unchecked_pairs(robot, progress)
    return PlannedCell(
        urdf=described.urdf,
        arms=tuple(_planned_arm(trial, arm) for arm in trial.arms),
        unchecked={pair: reason.value for pair, reason in unchecked.items()},
    )


def read_package(folder: Path, described: CellDescription) -> RobotModel:
    """Write a description with its meshes to a folder; return the robot that a reader finds there."""
    for name, content in described.meshes.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    (folder / "package.xml").write_text(f"<name>{described.package}</name>", encoding="utf-8")
    path = folder / "cellwright.urdf"
    path.write_text(described.urdf, encoding="utf-8")
    return read_urdf(path, warn=lambda _line: None)


def _planned_arm(trial: Trial, arm: Arm) -> PlannedArm:
    joints, prefix = joints_of(arm, trial.arm_models), arm.frame_prefix
    velocity, acceleration = _limits(trial, arm, joints)
    named = [
        {prefix + joint: each[joint] for joint in joints} for each in (home_of(arm, joints), velocity, acceleration)
    ]
    return PlannedArm(
        name="arm" if len(trial.arms) == 1 else arm.name,
        joints=tuple(named[0]),
        flange=prefix + ("tool0" if arm.is_original else arm.tip),
        tool=_tool_links(arm),
        home=named[0],
        max_velocity=named[1],
        max_acceleration=named[2],
        action=CONTROLLER_NAMES[FOLLOW_OF_ARM if arm.namespace else FOLLOW].format(arm=arm.namespace),
        fingers=_planned_fingers(arm),
    )


def _planned_fingers(arm: Arm) -> PlannedFingers | None:
    """Return the fingers of an arm's tool, each with half of the gripper's figures; None for another tool."""
    settings = arm.tool.fingers
    if settings is None:
        return None
    return PlannedFingers(
        joints=GripperNames(arm.frame_prefix).joints,
        opening=settings.opening / 2,
        max_velocity=settings.speed / 2,
        max_acceleration=settings.speed / 2 / _RISE,
        action=CONTROLLER_NAMES[in_namespace(GRIP, "{arm}" if arm.namespace else None)].format(arm=arm.namespace),
    )


def _tool_links(arm: Arm) -> tuple[str, ...]:
    """Return the links of an arm's tool, the one that holds parts first."""
    if arm.tool.kind == "none":
        return ()
    fingers = GripperNames(arm.frame_prefix).fingers if arm.tool.kind == "parallel" else ()
    return (arm.frame_of(arm.holder), *fingers)


def _misnamed(trial: Trial) -> list[Finding]:
    """Return the arms whose controllers know joints by other names than the description of all arms."""
    return [
        Finding(
            f"cell.arms.{arm.name}.names",
            f"MoveIt needs the names of the robot description in messages (got {arm.names}); write names: "
            f"{'prefixed' if arm.frame_prefix else 'plain'}",
        )
        for arm in trial.arms
        if arm.joint_prefix != arm.frame_prefix
    ]


def _on_robots(trial: Trial) -> list[Finding]:
    """Return the arms that a robot carries, which is in no description of the arms."""
    return [
        Finding(
            f"cell.arms.{arm.name}.mount",
            f"MoveIt plans for arms that stand in the world or on each other (got one on {arm.mount.on.robot}); "
            "leave the arm out",
        )
        for arm in trial.arms
        if arm.mount.on is not None and arm.mount.on.robot
    ]


def _limits(trial: Trial, arm: Arm, joints: Mapping[str, Limits]) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return the velocity and the acceleration of each joint that its drive follows, in units of rad or m, and s.

    With the original drives the wrists lag behind at the published velocities by nearly as much as is tolerated.
    """
    if arm.is_original:
        velocity, acceleration = DEFAULT_LIMITS.velocity, DEFAULT_LIMITS.acceleration
        return dict(zip(joints, velocity, strict=True)), dict(zip(joints, acceleration, strict=True))
    drives = stiff_drives(laden(arm, trial.arms, trial.arm_models), arm.bandwidth)
    speeds = {name: SPEED_SHARE * limits.velocity for name, limits in joints.items()}
    # a stiff drive has the position gain w^2 I
    own = {name: drives[arm.prefix + name] for name in joints}
    forces = {name: _EFFORT_SHARE * each.effort * arm.bandwidth**2 / each.p for name, each in own.items()}
    return speeds, {name: min(speeds[name] / _RISE, forces[name]) for name in joints}
