"""Actions of the bridge: goals of ROS 2 over the five topics that an action of ROS 1 has on the cell's bus."""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.task import Future

from cellwright.middleware.ros2.bridge.interfaces import fill, interface_class, values_of
from cellwright.middleware.ros2.bridge.node import RosNode, relative
from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind

SUCCEEDED = 3
"""Status of actionlib_msgs/GoalStatus for a goal that was reached."""


class TrajectoryAction:
    """Action of the cell, served in ROS 2 under each of `names`. A goal has an identifier of its own on the bus."""

    def __init__(
        self, ros: RosNode, link: LinkClient, sender: str, action: dict[str, Any], names: Sequence[str]
    ) -> None:
        self._ros = ros
        self._link = link
        self._sender = sender
        self._name: str = action["name"]
        self._class = interface_class(action["type"], "action")
        self._accepted: dict[int, str] = {}
        """Identifiers of accepted goals that rclpy does not execute yet, by Python's id of the goal."""
        self._handles: dict[str, Any] = {}
        self._results: dict[str, tuple[Future, Callable[[Any], None]]] = {}
        self._cancels: dict[str, tuple[Future, Callable[[Any], None]]] = {}
        """Ends of cancel requests that the cell has not answered, by the identifier of the goal."""
        link.subscribe(f"{self._name}/feedback", "", self._give_feedback, _ignore)
        link.subscribe(f"{self._name}/result", "", self._give_result, _ignore)
        ros.actions += [
            ActionServer(
                ros.node,
                self._class,
                relative(name),
                self._execute,
                goal_callback=self._take_goal,
                cancel_callback=self._take_cancel,
                callback_group=ros.group,
            )
            for name in names
        ]

    def end(self) -> None:
        """Abort all goals: the cell is gone."""
        for _, resolve in [*self._results.values(), *self._cancels.values()]:
            resolve(None)

    async def _take_goal(self, goal: Any) -> GoalResponse:
        name = uuid.uuid4().hex
        self._results[name] = self._ros.awaited()
        answer = await self._publish("goal", {"goal_id": {"id": name}, "goal": values_of(goal)})
        if answer.kind is FrameKind.DONE:
            self._accepted[id(goal)] = name
            return GoalResponse.ACCEPT
        del self._results[name]
        return GoalResponse.REJECT

    async def _take_cancel(self, handle: Any) -> CancelResponse:
        begun = next((name for name, each in self._handles.items() if each is handle), "")
        name = begun or self._accepted.get(id(handle.request), "")
        if not name:  # without an identifier the cell would cancel everything
            return CancelResponse.REJECT
        _, resolve = self._cancels[name] = self._ros.awaited()
        answer = await self._publish("cancel", {"id": name})
        self._cancels.pop(name, None)
        resolve(None)
        return CancelResponse.ACCEPT if answer.kind is FrameKind.DONE else CancelResponse.REJECT

    async def _execute(self, handle: Any) -> Any:
        name = self._accepted.pop(id(handle.request))
        self._handles[name] = handle
        try:
            values = await self._results[name][0]
            if name in self._cancels:  # the result may come first, but rclpy has to note the cancel request before it
                await self._cancels[name][0]
        finally:
            del self._handles[name], self._results[name]
        result = self._class.Result()
        if values is None:
            result.error_string = "the cell has ended"
            handle.abort()
            return result
        fill(result, values["result"])
        if values["status"]["status"] == SUCCEEDED:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:  # outside its tolerances, or another goal replaced it
            handle.abort()
        return result

    async def _publish(self, topic: str, values: dict[str, Any]) -> Frame:
        """Publish a message on one of the action's topics; return the cell's answer."""
        future, resolve = self._ros.awaited()
        try:
            self._link.request(
                FrameKind.PUBLISH,
                resolve,
                name=f"{self._name}/{topic}",
                node=self._sender,
                payload=json.dumps(values).encode(),
            )
        except FrameError as error:
            return Frame(FrameKind.REFUSED, payload=str(error).encode())
        answer: Frame = await future
        return answer

    def _give_feedback(self, payload: bytes) -> None:
        values = json.loads(payload)
        handle = self._handles.get(values["status"]["goal_id"]["id"])
        if handle is not None and handle.is_active:
            handle.publish_feedback(fill(self._class.Feedback(), values["feedback"]))

    def _give_result(self, payload: bytes) -> None:
        values = json.loads(payload)
        found = self._results.get(values["status"]["goal_id"]["id"])
        if found is not None:
            found[1](values)


def _ignore(_frame: Frame) -> None:
    """Ignore the answer to a subscription."""
