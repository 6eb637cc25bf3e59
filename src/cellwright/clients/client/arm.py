"""An arm of the kit-building cell and its gripper, as a client has them."""

import math
from collections.abc import Mapping, Sequence

from cellwright.clients.client.description import CellDescription
from cellwright.config import arm
from cellwright.config.gripper_links import GripperNames
from cellwright.config.ur10 import GRIPPER_JOINT
from cellwright.middleware.messages import osrf_gear
from cellwright.middleware.messages.arrays import JointArrays, joint_arrays
from cellwright.middleware.messages.control_msgs import GripperCommand
from cellwright.middleware.messages.conversions import NANOSECONDS, joint_trajectory, trajectory_point
from cellwright.middleware.messages.standard import JointTrajectory
from cellwright.util.errors import CellwrightError, UsageError

ARM_JOINTS = tuple(sorted(arm.ARM_JOINTS))
"""The arm's joints in the order of joint states (alphabetical)."""

ARRIVED = 0.01
"""Tolerance [rad; m for the rail] within which an arm at rest has arrived. The original's soft servos give way to
the arm's weight by 2.5 mrad at most, and by 8 mrad with 0.5 kg on the cup. Finals teams waited for 9 mrad.
"""

_STOPPED = 0.02
_FINGERS = GripperNames().joints
_OF_GRIPPERS = (GRIPPER_JOINT, *_FINGERS)
_REACHED = 0.001
"""Deviation [m] from the width that fingers were sent to at which they have reached it."""
_BLOCKED = 0.3
"""Time [s] in which fingers that something keeps from their width have not moved; a part is held after 0.1 s."""
_STILL = 0.0002
"""Change of the width [m] that is no motion."""


class ClientArm:
    """Arm with its gripper, over the topics and services below a namespace.

    Args:
        node: client of the cell.
        space: begin of the names: `/ariac`, or `/ariac/arm1` of one of several arms.
    """

    def __init__(self, node: CellDescription, space: str) -> None:
        self._node, self._space = node, space
        self.joint_states = node.latest(f"{space}/joint_states")
        """Newest joint states (sensor_msgs/JointState)."""
        self.gripper = node.latest(f"{space}/gripper/state")
        """Newest state of the gripper (osrf_gear/VacuumGripperState)."""

    def joint_arrays(self) -> JointArrays:
        """Return the newest joint states as arrays with their names; a UsageError before the first message."""
        if self.joint_states.message is None:
            raise UsageError("no joint states have come yet; let time pass first, such as by joint_states.wait()")
        return joint_arrays(self.joint_states.message)

    @property
    def joint_positions(self) -> Mapping[str, float]:
        """Newest joint positions [rad; m for the rail]; empty before the first message."""
        message = self.joint_states.message
        return {} if message is None else dict(zip(message.name, map(float, message.position), strict=True))

    @property
    def joint_velocities(self) -> Mapping[str, float]:
        """Newest joint velocities [rad/s; m/s for the rail]; empty before the first message."""
        message = self.joint_states.message
        return {} if message is None else dict(zip(message.name, map(float, message.velocity), strict=True))

    def send_arm(
        self,
        waypoints: Sequence[Sequence[float]],
        times: Sequence[float] | None = None,
        *,
        velocities: Sequence[Sequence[float]] | None = None,
        joints: Sequence[str] | None = None,
    ) -> None:
        """Send the arm along joint waypoints, without waiting.

        Args:
            waypoints: positions [rad; m for the rail] in the order of `joints`; an empty list brings the arm to rest.
            times: time of each waypoint [s] from now; 1, 2, 3, … by default.
            velocities: velocities at the waypoints [rad/s; m/s]; without them the path between is straight.
            joints: names of the joints of each waypoint; by default all, in the order of joint states.

        Raises:
            UsageError: the numbers of positions, times, velocities and joints do not match.
            RejectedCommandError: the arm refuses them, and continues its motion.
        """
        times = [float(number + 1) for number in range(len(waypoints))] if times is None else times
        if len(times) != len(waypoints) or (velocities is not None and len(velocities) != len(waypoints)):
            raise UsageError("times, and velocities if given, must have one entry for each waypoint")
        if not all(map(math.isfinite, times)):
            raise UsageError(f"times must be finite (got {list(times)})")
        self._node.publish(
            f"{self._space}/arm/command", trajectory_message(joints or self.joints, waypoints, times, velocities)
        )

    def move_arm(
        self,
        waypoints: Sequence[Sequence[float]],
        times: Sequence[float] | None = None,
        *,
        joints: Sequence[str] | None = None,
        timeout: float = 5.0,
        tolerance: float = ARRIVED,
    ) -> bool:
        """Send the arm along joint waypoints and wait until it rests at the last one.

        Arguments as for `send_arm`.

        Args:
            waypoints: at least one.
            times: as for `send_arm`.
            joints: as for `send_arm`.
            timeout: wait after the time of the last waypoint [s].
            tolerance: largest distance to the last waypoint [rad; m for the rail].

        Returns:
            True if the arm came to rest within `tolerance` of the last waypoint.

        Raises:
            UsageError: no waypoint, or the numbers of positions, times and joints do not match.
            RejectedCommandError: the arm refuses them, and continues its motion.
        """
        if not len(waypoints):
            raise UsageError("a motion needs at least one waypoint")
        self.send_arm(waypoints, times, joints=joints)
        self._node.sleep(float(len(waypoints)) if times is None else times[-1])
        goal = dict(zip(joints or self.joints, waypoints[-1], strict=False))
        return self._node.wait_until(lambda: self._stands_at(goal, tolerance), timeout)

    def _stands_at(self, goal: Mapping[str, float], tolerance: float) -> bool:
        positions, velocities = self.joint_positions, self.joint_velocities
        return bool(positions) and all(
            abs(positions[joint] - value) < tolerance and abs(velocities[joint]) < _STOPPED
            for joint, value in goal.items()
        )

    @property
    def gripper_enabled(self) -> bool:
        """True if the vacuum was on, or the fingers were closed, in the newest message."""
        return self.gripper.message is not None and bool(self.gripper.message.enabled)

    @property
    def gripper_attached(self) -> bool:
        """True if something was on the cup, or between the pads, in the newest message."""
        return self.gripper.message is not None and bool(self.gripper.message.attached)

    def control_gripper(self, enable: bool) -> bool:  # noqa: FBT001
        """Switch the vacuum on or off, or close or open the fingers with their largest force."""
        request = osrf_gear.VacuumGripperControlRequest(enable=enable)
        return bool(self._node.call(f"{self._space}/gripper/control", request).success)

    @property
    def gripper_width(self) -> float | None:
        """Newest distance between the pads of a parallel gripper [m]; None before the first message, or without one."""
        found = [value for name, value in self.joint_positions.items() if name.endswith(_FINGERS)]
        return sum(found) if found else None

    def command_gripper(self, width: float, effort: float = 0.0) -> None:
        """Send the fingers of a parallel gripper to a distance between the pads [m], without waiting.

        Args:
            width: as for `move_gripper`.
            effort: as for `move_gripper`.

        Raises:
            RejectedCommandError: a number is out of range, and the fingers go on as they did.
            UnknownNameError: the arm has no parallel gripper.
        """
        self._node.publish(f"{self._space}/gripper/command", GripperCommand(float(width), float(effort)))

    def move_gripper(self, width: float, effort: float = 0.0, *, timeout: float = 5.0) -> bool:
        """Move the fingers of a parallel gripper, and wait until they are there or something keeps them from it.

        Opening releases a part; `gripper_attached` tells whether closing has got one.

        Args:
            width: distance between the pads [m].
            effort: gripping force that is not exceeded [N]; 0 for the gripper's own.
            timeout: longest wait [s].

        Returns:
            True if the pads are at their distance.

        Raises:
            RejectedCommandError: a number is out of range, and the fingers go on as they did.
            UnknownNameError: the arm has no parallel gripper.

        Example: `is_held = not client.move_gripper(0.02, effort=15.0)` closes on a part that is wider than 20 mm.
        """
        self.command_gripper(width, effort)
        before, since = self.gripper_width, self._node.time

        def is_over() -> bool:
            nonlocal before, since
            present = self.gripper_width
            if present is None or before is None or abs(present - before) > _STILL:
                before, since = present, self._node.time
            return self._is_at(width) or self._node.time - since >= _BLOCKED

        self._node.wait_until(is_over, timeout)
        return self._is_at(width)

    def _is_at(self, width: float) -> bool:
        present = self.gripper_width
        return present is not None and abs(present - width) <= _REACHED

    @property
    def joints(self) -> Sequence[str]:
        """Names of the joints in the order of joint states; before the first message the cell is asked for them."""
        message = self.joint_states.message
        if message is None:
            return self._described_joints()
        return [name for name in message.name if not name.endswith(_OF_GRIPPERS)]

    def _described_joints(self) -> Sequence[str]:
        """Return the joints of the cell's description; those of 2017's arm if there is none, as in another's cell."""
        try:
            arms = {f"/ariac/{arm.namespace}".rstrip("/"): arm.name for arm in self._node.layout().arms}
            return sorted(joint.name for joint in self._node.chains()[arms[self._space]].joints)
        except (CellwrightError, KeyError):
            return ARM_JOINTS


def trajectory_message(
    joints: Sequence[str],
    waypoints: Sequence[Sequence[float]],
    times: Sequence[float],
    velocities: Sequence[Sequence[float]] | None = None,
) -> JointTrajectory:
    """Return a trajectory_msgs/JointTrajectory that begins on arrival; arguments as for `ClientArm.send_arm`."""
    points = [
        trajectory_point(
            positions,
            () if velocities is None else velocities[index],
            time_from_start=round(times[index] * NANOSECONDS),
        )
        for index, positions in enumerate(waypoints)
    ]
    return joint_trajectory(joints, points)
