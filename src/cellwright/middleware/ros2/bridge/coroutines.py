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
    """Action server of rclpy that executes its goals as coroutines of this module."""

    def notify_execute(self, goal_handle: Any, execute_callback: Any) -> None:
        """Begin to execute an accepted goal."""
        run(self._execute_goal(execute_callback or self._execute_callback, goal_handle))
