"""Actions of the bridge: goals of ROS 2 over the five topics that an action of ROS 1 has on the cell's bus."""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from rclpy.action import CancelResponse, GoalResponse

from cellwright.middleware.ros2.bridge.coroutines import Answer
from cellwright.middleware.ros2.bridge.interfaces import fill, interface_class, values_of
from cellwright.middleware.ros2.bridge.node import RosNode, relative
from cellwright.middleware.wire.command_queue import refusal_line
from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog, report
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind

SUCCEEDED = 3
"""Status of actionlib_msgs/GoalStatus for a goal that was reached."""

_AT_REST = 1e-6  # velocity [m/s, rad/s] that counts as 0


class CellAction:
    """Action of the cell, served in ROS 2 under each of `names`. A goal has an identifier of its own on the bus.

    Under another name than the cell's, which is that of ros2_control, a goal must pass that controller's checks too.
    """

    def __init__(
        self, ros: RosNode, loop: EventLoop, link: LinkClient, sender: str, action: dict[str, Any], names: Sequence[str]
    ) -> None:
        self._link = link
        self._sender = sender
        self._name: str = action["name"]
        self._class = interface_class(action["type"], "action")
        self._fault_of = _FAULTS.get(action["type"])
        self._accepted: dict[int, str] = {}
        """Identifiers of accepted goals that rclpy does not execute yet, by Python's id of the goal."""
        self._handles: dict[str, Any] = {}
        self._results: dict[str, Answer] = {}
        link.subscribe(f"{self._name}/feedback", "", self._give_feedback, _ignore)
        link.subscribe(f"{self._name}/result", "", self._give_result, _ignore)
        self._log = ros.log
        self._refusals = ThrottledLog(loop, "refused {subject} ({count} x)", ros.say)
        for name in names:
            ros.receiver.offer(
                self._class,
                relative(name),
                self._execute,
                goal_callback=partial(self._take_goal, ros.full_name(name), name != self._name),
                cancel_callback=self._take_cancel,
            )

    def end(self) -> None:
        """Abort all goals: the cell is gone."""
        for result in list(self._results.values()):
            result.give(None)

    async def _take_goal(self, action: str, is_strict: bool, goal: Any) -> GoalResponse:  # noqa: FBT001
        """Take a goal; ROS 2 gives a client no reason for a rejection, so it goes to /rosout."""
        values = values_of(goal)
        if is_strict and self._fault_of and (fault := self._fault_of(values)):
            self._refusals.count(f"{action}: {fault}")
            return GoalResponse.REJECT
        name = uuid.uuid4().hex
        self._results[name] = Answer()
        answered = Answer()
        try:
            self._publish("goal", {"goal_id": {"id": name}, "goal": values}, answered.give)
            answer = await answered
            is_accepted = answer.kind is FrameKind.DONE
            if line := refusal_line(answer, action):
                self._log(line)
        except FrameError as error:
            report(f"{self._name}: {error}")
            is_accepted = False
        if is_accepted:
            self._accepted[id(goal)] = name
            return GoalResponse.ACCEPT
        del self._results[name]
        return GoalResponse.REJECT

    def _take_cancel(self, handle: Any) -> CancelResponse:
        name = next((name for name, each in self._handles.items() if each is handle), "")
        # Without an identifier the cell would cancel everything.
        if not name:
            return CancelResponse.REJECT
        # The goal must be known as cancelled when its result comes, which is before the cell's answer to this.
        self._publish("cancel", {"id": name}, None)
        return CancelResponse.ACCEPT

    async def _execute(self, handle: Any) -> Any:
        name = self._accepted.pop(id(handle.request))
        self._handles[name] = handle
        try:
            values = await self._results[name]
        finally:
            del self._handles[name], self._results[name]
        result = self._class.Result()
        if values is None:
            if hasattr(result, "error_string"):
                result.error_string = "the cell has ended"
            handle.abort()
            return result
        fill(result, values["result"])
        if values["status"]["status"] == SUCCEEDED:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:  # outside its tolerances, or another goal or command replaced it
            handle.abort()
        return result

    def _publish(self, topic: str, values: dict[str, Any], answered: Callable[[Frame], None] | None) -> None:
        """Publish a message on one of the action's topics; `answered` gets the cell's answer."""
        payload = json.dumps(values).encode()
        self._link.request(
            FrameKind.PUBLISH, answered, name=f"{self._name}/{topic}", node=self._sender, payload=payload
        )

    def _give_feedback(self, payload: bytes) -> None:
        values = json.loads(payload)
        handle = self._handles.get(values["status"]["goal_id"]["id"])
        if handle is not None and handle.is_active:
            handle.publish_feedback(fill(self._class.Feedback(), values["feedback"]))

    def _give_result(self, payload: bytes) -> None:
        values = json.loads(payload)
        found = self._results.get(values["status"]["goal_id"]["id"])
        if found is not None:
            found.give(values)


def fault_of(goal: dict[str, Any]) -> str:
    """Return why `joint_trajectory_controller` of ROS 2 rejects a goal that a controller of 2017 takes; else empty."""
    points = goal["trajectory"]["points"]
    if any(point["effort"] for point in points):
        return "its points have efforts, which this controller does not take; leave them empty"
    if points and any(abs(velocity) > _AT_REST for velocity in points[-1]["velocities"]):
        return "its last point has velocities other than 0; end at rest"
    return ""


_FAULTS: dict[str, Callable[[dict[str, Any]], str]] = {"control_msgs/FollowJointTrajectory": fault_of}
"""Checks of ros2_control's controllers that the cell lacks, by the type of the action."""


def _ignore(_frame: Frame) -> None:
    """Ignore the answer to a subscription."""
