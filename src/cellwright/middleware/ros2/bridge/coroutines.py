"""Coroutines of actions, which rclpy's executor would call milliseconds late.

A coroutine continues in the thread that brings the answer it waits for. Only one runs at a time, as with an executor of
one thread.
"""

from __future__ import annotations

import threading
from collections.abc import Coroutine, Generator
from typing import Any

from rclpy.action import ActionServer

from cellwright.middleware.wire.event_loop import report

_LOCK = threading.RLock()


class Answer:
    """Answer that one coroutine awaits; any thread may give it, and the first one counts."""

    def __init__(self) -> None:
        self._values: list[Any] = []
        self._coroutine: Coroutine[Any, Any, Any] | None = None

    def give(self, value: Any) -> None:
        """Set the answer, and continue the coroutine in this thread."""
        with _LOCK:
            if self._values:
                return
            self._values.append(value)
            if self._coroutine is not None:
                run(self._coroutine)

    def __await__(self) -> Generator[Answer, None, Any]:
        if not self._values:
            yield self
        return self._values[0]

    def wake(self, coroutine: Coroutine[Any, Any, Any]) -> None:
        """Continue this coroutine when the answer comes."""
        self._coroutine = coroutine


def run(coroutine: Coroutine[Any, Any, Any]) -> None:
    """Run a coroutine until it ends, or until it waits for an answer; report a defect in it."""
    with _LOCK:
        try:
            coroutine.send(None).wake(coroutine)
        except StopIteration:
            pass
        except Exception as defect:
            report(f"internal error, please report it: {type(defect).__name__}: {defect}")


class GoalServer(ActionServer):  # type: ignore[misc]
    """Action server of rclpy that executes its goals as coroutines of this module.

    A request to cancel waits for the answers to goals that came before it: until then rclpy does not know these goals.
    """

    def __init__(self, *arguments: Any, **more: Any) -> None:
        self._unanswered = 0  # goals that the cell has not answered yet
        self._waiting: list[Answer] = []  # for requests to cancel
        super().__init__(*arguments, **more)

    async def _execute_goal_request(self, request_header_and_message: Any) -> None:
        self._unanswered += 1
        try:
            await super()._execute_goal_request(request_header_and_message)
        finally:
            self._unanswered -= 1
            while self._waiting and not self._unanswered:
                self._waiting.pop(0).give(None)

    async def _execute_cancel_request(self, request_header_and_message: Any) -> None:
        if self._unanswered:
            answered = Answer()
            self._waiting.append(answered)
            await answered
        await super()._execute_cancel_request(request_header_and_message)

    def notify_execute(self, goal_handle: Any, execute_callback: Any) -> None:
        """Begin to execute an accepted goal."""
        run(self._execute_goal(execute_callback or self._execute_callback, goal_handle))
