"""The arm's action `follow_joint_trajectory`: the actionlib protocol on five topics.

A goal that cannot be followed is rejected at once with the reason in its result. A goal that is followed reports ten
times a second, and ends succeeded, aborted (outside its tolerances) or preempted (cancelled, or something else came).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from cellwright.bus import Bus, Publisher
from cellwright.contracts.gear_commands import SIMULATOR, trajectory_of
from cellwright.devices.arm import Arm
from cellwright.devices.joint_trajectory_controller import Following
from cellwright.devices.trajectory_command import RejectedTrajectoryError
from cellwright.devices.trajectory_goal import GoalRequest, TrajectoryGoal
from cellwright.devices.trajectory_tolerance import AskedTolerance
from cellwright.messages.build import header, nanoseconds, stamp, trajectory_point
from cellwright.messages.control_msgs import (
    FollowJointTrajectoryActionFeedback,
    FollowJointTrajectoryActionGoal,
    FollowJointTrajectoryActionResult,
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryResult,
    JointTolerance,
)
from cellwright.messages.standard import GoalID, GoalStatus, GoalStatusArray
from cellwright.simulation.clock import NANOSECONDS
from cellwright.simulation.simulation import Simulation
from cellwright.simulation.watches import Watch

NAME = "/ariac/arm/follow_joint_trajectory"
REJECTED = 5
"""actionlib_msgs/GoalStatus.REJECTED"""

STATUS_PERIOD = Fraction(1, 5)
"""Time between two status messages [s] (the default of actionlib's server)."""

FEEDBACK_PERIOD = Fraction(1, 10)
"""Time between two looks at the goal [s] (the original's action_monitor_rate)."""

REMEMBERED = 5 * NANOSECONDS
"""How long the status of a goal that has ended is still told [ns] (the default of actionlib's server)."""


class TrajectoryAction:
    """The action server of one arm."""

    def __init__(self, bus: Bus, simulation: Simulation, arm: Arm) -> None:
        self._simulation = simulation
        self._arm = arm
        self._statuses: dict[str, tuple[GoalStatus, int | None]] = {}
        self._count = 0
        self._watches: dict[str, Watch] = {}
        types = "control_msgs/FollowJointTrajectoryAction"
        bus.listen(f"{NAME}/goal", f"{types}Goal", self._take_goal, node=SIMULATOR)
        bus.listen(f"{NAME}/cancel", "actionlib_msgs/GoalID", self._take_cancel, node=SIMULATOR)
        self._result = bus.advertise(f"{NAME}/result", f"{types}Result", rate="at the end of a goal", node=SIMULATOR)
        self._status = self._sampled(
            bus, "status", "actionlib_msgs/GoalStatusArray", STATUS_PERIOD, self._publish_status
        )
        self._feedback = self._sampled(bus, "feedback", f"{types}Feedback", FEEDBACK_PERIOD, self._publish_feedback)
        arm.on_goal_ended.append(self._tell_ended)

    # ---------------------------------------------------------------- what comes in

    def _take_goal(self, message: FollowJointTrajectoryActionGoal, node: str) -> None:
        goal_id = message.goal_id
        if not goal_id.id:
            self._count += 1
            goal_id = GoalID(stamp(self._simulation.now), f"{node}-{self._count}-{self._simulation.time:.9f}")
        try:
            self._arm.accept(request_of(message, goal_id.id))
        except RejectedTrajectoryError as error:
            self._note(GoalStatus(goal_id, REJECTED, str(error)), ended=True)
            self._publish_result(goal_id.id, int(error.result), str(error))
            raise  # counted and reported with the other refusals
        self._note(GoalStatus(goal_id, 1, ""), ended=False)

    def _take_cancel(self, message: GoalID, _node: str) -> None:
        """Cancel by identifier, by time (all goals up to it), or everything when both are empty."""
        goal = self._arm.controller.goal
        if goal is None or not goal.active:
            return
        until = nanoseconds(message.stamp)
        given = nanoseconds(self._statuses[goal.goal_id][0].goal_id.stamp) if goal.goal_id in self._statuses else 0
        everything = not message.id and until == 0
        if everything or message.id == goal.goal_id or (until and given <= until):
            self._arm.cancel()

    # ---------------------------------------------------------------- what goes out

    def _tell_ended(self, goal: TrajectoryGoal) -> None:
        known = self._statuses.get(goal.goal_id)
        goal_id = known[0].goal_id if known else GoalID(stamp(0), goal.goal_id)
        self._note(GoalStatus(goal_id, int(goal.status), goal.reason), ended=True)
        self._publish_result(goal.goal_id, 0 if goal.result is None else int(goal.result), goal.reason)

    def _publish_result(self, goal_id: str, code: int, reason: str) -> None:
        now = self._simulation.now
        status = self._statuses[goal_id][0]
        self._result.publish(
            FollowJointTrajectoryActionResult(header("", now), status, FollowJointTrajectoryResult(code, reason))
        )

    def _publish_status(self, _index: int) -> None:
        now = self._simulation.now
        self._statuses = {
            name: (status, ended)
            for name, (status, ended) in self._statuses.items()
            if ended is None or now - ended <= REMEMBERED
        }
        self._status.publish(GoalStatusArray(header("", now), [status for status, _ in self._statuses.values()]))

    def _publish_feedback(self, _index: int) -> None:
        goal = self._arm.controller.goal
        if goal is None or not goal.active or goal.goal_id not in self._statuses:
            return
        now = self._simulation.now
        content = feedback_of(self._arm.controller.joint_names, self._arm.following(), now)
        status = self._statuses[goal.goal_id][0]
        self._feedback.publish(FollowJointTrajectoryActionFeedback(header("", now), status, content))

    # ---------------------------------------------------------------- inside

    def _note(self, status: GoalStatus, *, ended: bool) -> None:
        self._statuses[status.goal_id.id] = (status, self._simulation.now if ended else None)

    def _sampled(self, bus: Bus, name: str, type_name: str, period: Fraction, publish: Any) -> Publisher:
        def take_listeners(count: int) -> None:
            watch = self._watches.pop(name, None)
            if watch is not None:
                watch.cancel()
            if count:
                self._watches[name] = self._simulation.watch(f"{NAME}/{name}", period, publish)

        rate = f"{1 / period} Hz"
        return bus.advertise(f"{NAME}/{name}", type_name, rate=rate, node=SIMULATOR, on_listeners=take_listeners)


def request_of(message: FollowJointTrajectoryActionGoal, goal_id: str) -> GoalRequest:
    """A goal from its message."""
    goal = message.goal
    return GoalRequest(
        goal_id,
        trajectory_of(goal.trajectory),
        tuple(map(_tolerance, goal.path_tolerance)),
        tuple(map(_tolerance, goal.goal_tolerance)),
        nanoseconds(goal.goal_time_tolerance),
    )


def _tolerance(message: JointTolerance) -> AskedTolerance:
    return AskedTolerance(message.name, message.position, message.velocity)


def feedback_of(names: tuple[str, ...], following: Following, now: int) -> FollowJointTrajectoryFeedback:
    """How the joints follow, as feedback."""
    desired = following.desired
    return FollowJointTrajectoryFeedback(
        header("", now),
        list(names),
        trajectory_point(desired.positions, desired.velocities, desired.accelerations),
        trajectory_point(following.actual_positions, following.actual_velocities),
        trajectory_point(following.error_positions, following.error_velocities),
    )
