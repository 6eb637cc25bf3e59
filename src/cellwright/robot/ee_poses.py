"""End-effector poses: the topics, and the inverse kinematics steps that bring the tips of the arms there."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.inverse_kinematics import ArmLimits, ArmSolver
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages.conversions import header, nanoseconds, pose_message
from cellwright.middleware.messages.standard import Pose as PoseMessage
from cellwright.middleware.messages.standard import PoseArray
from cellwright.robot.commander import Commander
from cellwright.robot.interface import JOINT_SOURCES, TARGET_EE_POSES
from cellwright.robot.limiter import Numbers
from cellwright.robot.model import body_of
from cellwright.robot.servos import Array, fastest
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose

VELOCITY_SHARE = 0.9
"""Share of the servos' speeds for motions to a pose; they need the rest to keep up."""
MAX_POSE_DISTANCE = 1000.0
"""Maximum distance of a pose [m]; a farther one is taken for a mistake."""
MIN_QUATERNION_LENGTH = 1e-6
"""Minimum length of a quaternion with a direction."""


@dataclass
class _ArmTarget:
    """An arm and its target pose; it has no motion while `target` is None."""

    numbers: Numbers
    solver: ArmSolver
    tip: str
    reference: str
    home: Array
    target: Pose | None = None

    def __post_init__(self) -> None:
        self.positions = self.home.copy()


class EePoses(Device):
    """Target poses of the tips of all arms: right, left.

    Steps start from the desired posture, not from the robot's: the servos follow, and the targets depend on the
    commands alone. Joints outside the arms keep their targets; a waist never moves to reach a pose. A later command for
    joints of an arm, from any source, ends the motion of that arm. The next poses begin a new one.

    Args:
        config: the robot.
        commander: decides whether a command is taken, and has joints follow.
        model: the engine's model of the robot alone.
        message_time: returns the time that messages carry [ns].
        caps: maximum speed of a tip along [m/s], and about [rad/s].
    """

    def __init__(
        self,
        config: RobotConfig,
        commander: Commander,
        model: mujoco.MjModel,
        message_time: Callable[[], int],
        caps: tuple[float, float],
    ) -> None:
        super().__init__("ee poses")
        self._config, self._commander, self._message_time = config, commander, message_time
        self._topic = commander.sources[JOINT_SOURCES.index(TARGET_EE_POSES)]
        self._model, self._data = model, mujoco.MjData(model)
        self._arms: list[_ArmTarget] = []
        joints = commander.driver.joints
        self._qpos = np.array([model.joint(name).qposadr[0] for name in joints], dtype=int)
        for place, arm in enumerate(config.arms):
            tip = config.command_links[place] if place < len(config.command_links) else arm.tip
            reference = config.reference_links[place] if place < len(config.reference_links) else None
            reference = reference or config.robot.root
            driven = [config.robot.joint(name) for name in arm.joints]
            limits = ArmLimits(
                lower=np.array([each.limits.lower for each in driven]),
                upper=np.array([each.limits.upper for each in driven]),
                velocity=VELOCITY_SHARE * np.array([fastest(each) for each in driven]),
                caps=caps,
            )
            home = np.array(arm.home)
            bodies = {"tip": body_of(tip), "reference": body_of(reference)}
            solver = ArmSolver(model, joints=arm.joints, **bodies, home=home, limits=limits)
            numbers = np.array([joints.index(name) for name in arm.joints], dtype=np.intp)
            self._arms.append(_ArmTarget(numbers, solver, tip, reference, home))

    def attach(self, simulation: Simulation) -> None:
        """Keep the length of a step."""
        super().attach(simulation)
        self._timestep = float(simulation.clock.timestep)

    def reset(self) -> None:
        """End all motions."""
        for arm in self._arms:
            arm.target, arm.positions = None, arm.home.copy()

    @property
    def tips(self) -> tuple[str, ...]:
        """Link of each arm that is brought to poses."""
        return tuple(arm.tip for arm in self._arms)

    @property
    def references(self) -> tuple[str, ...]:
        """Reference link of each arm, in whose frame its poses are given."""
        return tuple(arm.reference for arm in self._arms)

    @property
    def targets(self) -> tuple[Pose | None, ...]:
        """Target of each tip, reference_T_tip; None for an arm without one."""
        return tuple(arm.target for arm in self._arms)

    def aim(self, poses: Sequence[Pose | None]) -> None:
        """Set the target of each arm's tip, reference_T_tip; None leaves an arm unchanged."""
        measured = self._commander.measured()
        for arm, pose in zip(self._arms, poses, strict=True):
            if pose is None:
                continue
            if arm.target is None or not self._commander.is_source_of(self._topic, arm.numbers):
                arm.positions = np.clip(measured[arm.numbers], arm.solver.limits.lower, arm.solver.limits.upper)
                self._commander.follow(self._topic, arm.numbers, arm.positions)
            arm.target = pose

    def poses(self, link: str | None = None) -> list[Pose]:
        """Return reference_T_tip of each arm, or reference_T_link of any link, from the newest readings."""
        self._data.qpos[self._qpos] = self._commander.measured()
        mujoco.mj_kinematics(self._model, self._data)
        body = None if link is None else body_of(link)
        return [arm.solver.pose(self._data, body) for arm in self._arms]

    def before_step(self) -> None:
        """Move the joints of each arm with a target one step further."""
        commander = self._commander
        moving = []
        for arm in self._arms:
            if arm.target is not None and commander.is_source_of(self._topic, arm.numbers):
                moving.append((arm, arm.target))
            else:
                arm.target = None
        if not moving:
            return
        data = self._data
        # The applied positions lag behind those of the arms where speeds are limited; a step starts from the arms' own.
        data.qpos[self._qpos] = commander.applied
        for arm, _ in moving:
            data.qpos[arm.solver.qpos] = arm.positions
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_comPos(self._model, data)
        for arm, target in moving:
            moved = arm.positions + arm.solver.step(data, target, self._timestep)
            arm.positions = np.clip(moved, arm.solver.limits.lower, arm.solver.limits.upper)
            commander.follow(self._topic, arm.numbers, arm.positions)

    def get_state(self) -> State:
        """Return the targets of the arms and their progress."""
        return {
            "targets": [arm.target and [*arm.target.position, *arm.target.quaternion] for arm in self._arms],
            "positions": [arm.positions.tolist() for arm in self._arms],
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        for arm, target, positions in zip(self._arms, state["targets"], state["positions"], strict=True):
            arm.target = None if target is None else Pose(tuple(target[:3]), tuple(target[3:]))
            arm.positions = np.array(positions)

    def target_ee_poses(self, row: Endpoint, message: PoseArray, node: str) -> None:
        """Move the tips to poses.

        A `frame_id` that names a link of the robot gives the frame of the poses, at that link's current pose. Any
        other, including the empty one, has no meaning: each pose is in the frame of its arm's reference.

        Raises:
            RejectedCommandError: the number of poses is not that of the arms, or a pose is invalid.
        """
        count = len(self._arms)
        if len(message.poses) != count:
            needed = "1 pose" if count == 1 else f"{count} poses, right, left"
            raise RejectedCommandError(f"poses must have {needed} (got {len(message.poses)})")
        poses = [_checked_pose(each, f"poses[{place}]") for place, each in enumerate(message.poses)]
        frame = message.header.frame_id
        if frame in self._config.robot.link_indices:
            poses = [frame_pose @ pose for frame_pose, pose in zip(self.poses(frame), poses, strict=True)]
        stamp = nanoseconds(message.header.stamp)
        if self._commander.admit(row.name, node, stamp):
            self.aim(poses)
            self._commander.confirm(row.name, node, stamp)

    def ee_poses(self, output: Output) -> None:
        """Publish the poses of the tips."""
        frame = self.references[0] if len(set(self.references)) == 1 else ""
        output.sample(
            lambda: PoseArray(header(frame, self._message_time()), [pose_message(each) for each in self.poses()])
        )


def _checked_pose(message: PoseMessage, where: str) -> Pose:
    """Return the pose in a message, with a unit quaternion."""
    p, q = message.position, message.orientation
    numbers = (p.x, p.y, p.z, q.w, q.x, q.y, q.z)
    length = math.hypot(*numbers[3:])
    if not all(map(math.isfinite, (*numbers, length))):
        raise RejectedCommandError(f"{where} must be finite")
    if math.hypot(*numbers[:3]) > MAX_POSE_DISTANCE:
        raise RejectedCommandError(f"{where}.position must be within {MAX_POSE_DISTANCE:g} m")
    if length < MIN_QUATERNION_LENGTH:
        raise RejectedCommandError(f"{where}.orientation must be a quaternion (x, y, z, w), not all zeros")
    return Pose((p.x, p.y, p.z), (q.w / length, q.x / length, q.y / length, q.z / length))
