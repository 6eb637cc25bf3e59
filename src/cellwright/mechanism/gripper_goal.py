"""Goals of a parallel gripper: a distance between the pads and a largest force, one at a time.

They are those of the actions GripperCommand of control_msgs, in ROS 1 and ROS 2, and ParallelGripperCommand of ROS 2,
without their transport. A goal succeeds when the pads are at their distance, and also when something between them
keeps them from it: that is how a gripper grips. Its result says which. The gripper controllers of ros2_control do the
same where stalling is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from cellwright.engine.device import State
from cellwright.mechanism.parallel_gripper import GOAL_TOLERANCE, ParallelGripper
from cellwright.mechanism.trajectory_goal import GoalStatus
from cellwright.util.errors import RejectedCommandError


@dataclass(frozen=True, slots=True)
class GripperRequest:
    """Goal as received.

    Attributes:
        goal_id: identifier of the goal; empty for a command without one.
        position: distance between the pads [m].
        max_effort: gripping force that is not exceeded [N]; 0: the gripper's own, which also limits it.
        max_speed: speed of that distance [m/s]; 0: the gripper's own, which also limits it.
    """

    goal_id: str
    position: float
    max_effort: float = 0.0
    max_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class JointCommand:
    """Command for one or both finger joints.

    Attributes:
        names: names of the joints; empty for one finger.
        positions: their positions [m]; 0 where the pads meet.
        velocities: largest speeds [m/s]; empty or 0 for the fingers' own.
        efforts: largest forces [N]; empty or 0 for the fingers' own.
    """

    names: Sequence[str]
    positions: Sequence[float]
    velocities: Sequence[float] = ()
    efforts: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class GripperReport:
    """Feedback and result of a goal.

    Attributes:
        position: distance between the pads [m].
        speed: its speed [m/s].
        effort: gripping force [N].
        stalled: True if something keeps the fingers from their goal.
        reached_goal: True if they are there.
    """

    position: float
    speed: float
    effort: float
    stalled: bool
    reached_goal: bool


@dataclass(frozen=True, slots=True)
class GripperGoal:
    """Accepted goal.

    Attributes:
        goal_id: identifier of the goal.
        width: distance between the pads [m].
        max_force: gripping force that is not exceeded [N].
        status: its status; ACTIVE until it ends.
        reason: reason for its end, in a sentence; empty while it is active.
        result: the gripper at its end; None while it is active.
    """

    goal_id: str
    width: float
    max_force: float
    status: GoalStatus = GoalStatus.ACTIVE
    reason: str = ""
    result: GripperReport | None = None


class GripperGoals:
    """Goals of one gripper. A new goal ends the one before, and so does another command to the gripper.

    The goal is part of the state of the device that uses this class.

    Args:
        gripper: the gripper.

    Attributes:
        goal: the last goal, active or not; None before the first.
        on_ended: callbacks for each goal that has ended.
    """

    def __init__(self, gripper: ParallelGripper) -> None:
        self.goal: GripperGoal | None = None
        self.on_ended: list[Callable[[GripperGoal], None]] = []
        self._gripper = gripper
        gripper.on_change.append(self._update)

    @property
    def active(self) -> GripperGoal | None:
        """The active goal."""
        return self.goal if self.goal is not None and self.goal.status is GoalStatus.ACTIVE else None

    def reset(self) -> None:
        """Forget the goal, at the start of a run."""
        self.goal = None

    def accept(self, request: GripperRequest) -> GripperGoal:
        """Move to a goal, in place of the active one.

        Raises:
            RejectedCommandError: the gripper cannot move there, or a number is not valid; nothing has changed.
        """
        width, force, speed = self._checked(request)
        self._end(GoalStatus.PREEMPTED, "another goal came")
        # before the goal is active: the gripper reports its command
        self._gripper.move(width, force, speed)
        self.goal = GripperGoal(request.goal_id, width, force)
        return self.goal

    def command(self, request: GripperRequest) -> None:
        """Move as for a goal, without one; the active goal ends.

        Raises:
            RejectedCommandError: as for `accept`.
        """
        width, force, speed = self._checked(request)
        self._end(GoalStatus.PREEMPTED, "another command came")
        self._gripper.move(width, force, speed)

    def cancel(self) -> bool:
        """End the active goal, and stop the fingers; a part stays held. Return whether there was a goal."""
        if self.active is None:
            return False
        self._end(GoalStatus.PREEMPTED, "it was cancelled")
        self._gripper.stop()
        return True

    def report(self) -> GripperReport:
        """Return the present state of the gripper."""
        width, speed, force = self._gripper.read()
        return GripperReport(width, speed, force, self._gripper.stalled, self._gripper.reached)

    def get_state(self) -> dict[str, Any]:
        """Return the goal as JSON values."""
        return {"goal": None if self.goal is None else asdict(self.goal)}

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        found = state["goal"]
        if found is None:
            self.goal = None
            return
        result = None if found["result"] is None else GripperReport(**found["result"])
        self.goal = GripperGoal(**{**found, "status": GoalStatus(found["status"]), "result": result})

    def _checked(self, request: GripperRequest) -> tuple[float, float, float]:
        """Return the width [m], the force [N] and the speed [m/s] of a request."""
        settings = self._gripper.settings
        place = f"goal {request.goal_id!r}: " if request.goal_id else ""
        for name, value in (("max_effort", request.max_effort), ("max_speed", request.max_speed)):
            if not 0.0 <= value < math.inf:
                raise RejectedCommandError(f"{place}{name} must be a number from 0 (got {value:g})")
        # by so much a width may be off when it was reached, and programs send what they have read
        if not -GOAL_TOLERANCE <= request.position <= settings.opening + GOAL_TOLERANCE:
            raise RejectedCommandError(
                f"{place}the distance between the pads must be from 0 to {settings.opening:g} m "
                f"(got {request.position:g})"
            )
        width = min(max(request.position, 0.0), settings.opening)
        force, speed = (
            min(asked, own) if asked > 0.0 else own
            for asked, own in ((request.max_effort, settings.force), (request.max_speed, settings.speed))
        )
        return width, force, speed

    def _update(self, gripper: ParallelGripper) -> None:
        goal = self.active
        if goal is None:
            return
        if (gripper.goal, gripper.max_force) != (goal.width, goal.max_force):
            self._end(GoalStatus.PREEMPTED, "another command came")
        elif gripper.reached or gripper.stalled:
            text = "the fingers are at their goal" if gripper.reached else "something keeps the fingers from their goal"
            self._end(GoalStatus.SUCCEEDED, text)

    def _end(self, status: GoalStatus, reason: str) -> None:
        """End the active goal, if there is one."""
        goal = self.active
        if goal is None:
            return
        ended = GripperGoal(goal.goal_id, goal.width, goal.max_force, status, reason, self.report())
        self.goal = ended
        for listener in self.on_ended:
            listener(ended)


def request_of_joints(goal_id: str, command: JointCommand, joints: tuple[str, str]) -> GripperRequest:
    """Return the request of a command for finger joints, as in ParallelGripperCommand.

    The fingers stand at equal distances from the middle and share the force. So position, speed and effort of one are
    half of the gripper's.

    Args:
        goal_id: identifier of the goal.
        command: the command.
        joints: names of the two fingers' joints.

    Raises:
        RejectedCommandError: these are not one or both fingers with a position each, or both differ.

    Example:
        >>> command = JointCommand(["left_finger_joint"], [0.02], efforts=[10.0])
        >>> request = request_of_joints("grip", command, ("left_finger_joint", "right_finger_joint"))
        >>> request.position, request.max_effort, request.max_speed
        (0.04, 20.0, 0.0)
    """
    fingers = list(command.names) or [joints[0]]
    strangers = [name for name in fingers if name not in joints]
    if strangers or len(set(fingers)) < len(fingers):
        raise RejectedCommandError(f"joints must be {' or '.join(joints)}, each once (got {', '.join(fingers):.200})")
    values = {"a position": command.positions, "a velocity": command.velocities, "an effort": command.efforts}
    for name, each in values.items():
        if len(each) != len(fingers) and (len(each) or name == "a position"):
            raise RejectedCommandError(f"{name} is needed for each joint (got {len(each)} for {len(fingers)})")
    positions = [float(each) for each in command.positions]
    if abs(positions[0] - positions[-1]) > GOAL_TOLERANCE:
        raise RejectedCommandError(
            f"both fingers stand at the same distance from the middle (got {positions[0]:g} and {positions[1]:g} m)"
        )
    speed, effort = map(_limit, (command.velocities, command.efforts))
    return GripperRequest(goal_id, 2.0 * sum(positions) / len(positions), effort, speed)


def _limit(values: Sequence[float]) -> float:
    """Return the limit for both fingers together from those of each; 0 for none, and a wrong number if there is one."""
    wrong = [value for value in values if not 0.0 <= value < math.inf]
    return 2.0 * float(min(wrong or [value for value in values if value > 0.0], default=0.0))
