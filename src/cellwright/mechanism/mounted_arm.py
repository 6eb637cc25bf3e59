"""Arms of a cell as programs plan with them: a solver on the base, and the places of that base.

arm = mounted_arm(trial.arms[0], trial.arm_models)
for position, world_T_base in arm.mount.places(world_T_tool, arm.position):
    for q in arm.solver.branches(world_T_base.inverse() @ world_T_tool, arm.solver.home):
        ...
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from cellwright.config.layout.arm_models import FACE_DEPTH, ArmModel, arm_model, home_of, joints_of
from cellwright.config.layout.arms import Arm
from cellwright.config.robot.model import link_poses
from cellwright.config.ur10 import GRIPPER, UR10
from cellwright.mechanism.solvers import solver_of
from cellwright.motion.chain import Chain, chain_of
from cellwright.motion.mounts import FixedMount, RailMount
from cellwright.motion.solver import Mount, Solver, Vector
from cellwright.util.pose import Pose

_GRIPPER_T_FACE = Pose.from_rpy((0.0, 0.0, -FACE_DEPTH), (math.pi, 0.0, 0.0))
_COMFORTABLE = (0.256, 0.568)
"""Ring about the pan axis in which an arm is neither folded up nor stretched, as shares of its reach: the UR10's."""


@dataclass(frozen=True)
class MountedArm:
    """Arm of a cell on its mount.

    The z axis of its tool points out of it. Its origin is the middle of the cup's face, or that between the pads of
    fingers; without either, that of the tip.

    Attributes:
        name: its name in the layout.
        chain: the arm from its base to its tool, without a rail.
        home: posture of the chain in which a run begins [rad; m].
        mount: places of the base.
        rail: joint of the rail; empty without one.
        position: position on the mount in which a run begins [m].
    """

    name: str
    chain: Chain
    home: Vector
    mount: Mount
    rail: str
    position: float

    @cached_property
    def solver(self) -> Solver:
        """Solver of the chain."""
        return solver_of(self.chain, self.home)

    def joints(self, position: float, q: Sequence[float]) -> dict[str, float]:
        """Return the positions of all joints [rad; m], that of the rail too, by their names in messages."""
        rail = {self.rail: position} if self.rail else {}
        return rail | {joint.name: value for joint, value in zip(self.chain.joints, q, strict=True)}


def mounted_arm(arm: Arm, models: Mapping[str, ArmModel], world_T_mount: Pose | None = None) -> MountedArm:
    """Return an arm of a layout with its mount.

    Args:
        arm: the arm.
        models: models of the arms of the layout that are not that of 2017, by name.
        world_T_mount: frame of its mount, as `mount_pose` gives it where another arm has taken it; by default as a run
            begins.

    Example:
        >>> import cellwright
        >>> arm = mounted_arm(cellwright.load_trial("lesson").arms[0], {})
        >>> len(arm.chain.joints), arm.rail
        (6, 'linear_arm_actuator_joint')
    """
    robot = UR10 if arm.is_original else arm_model(arm, models[arm.name], "")
    rail = robot.driven[0] if arm.mount.kind == "rail" else None
    base = robot.root if rail is None else rail.child
    ahead = 0.0 if arm.tool.fingers is None else arm.tool.length
    tip, tip_T_tool = (GRIPPER, _GRIPPER_T_FACE) if GRIPPER in robot.links else (arm.tip, Pose((0.0, 0.0, ahead)))
    chain = chain_of(robot, tip, base=base, tip_T_tool=tip_T_tool)
    home = home_of(arm, joints_of(arm, models))
    world_T_base = (world_T_mount or arm.pose) @ link_poses(robot, {})[base]
    mount: Mount = FixedMount(world_T_base)
    if rail is not None:
        inner, outer = (share * chain.reach for share in _COMFORTABLE)
        mount = RailMount(world_T_base, rail.axis, rail.limits.lower, rail.limits.upper, (inner, outer))
    return MountedArm(
        arm.name,
        chain,
        tuple(home[joint.name] for joint in chain.joints),
        mount,
        "" if rail is None else rail.name,
        0.0 if rail is None else home[rail.name],
    )
