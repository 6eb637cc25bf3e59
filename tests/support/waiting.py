"""Waiting for a condition: one helper, one bound, and the last value on failure."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

Value = TypeVar("Value")

TIMEOUT = 240.0
"""Bound of every wait [s]: a second on a quiet machine may be a minute on a busy one."""


def wait_until(
    condition: Callable[[], Value],
    what: str,
    *,
    seen: Callable[[], object] | None = None,
    between: Callable[[], object] | None = None,
    timeout: float = TIMEOUT,
) -> Value:
    """Poll a condition until it holds, and return its value.

    Clients under the Python of ROS 1 get this function with their own source, see `tests.ros1.client`.

    Args:
        condition: polled; the wait ends when its value is true.
        what: noun of what is expected, such as "end of the bridge".
        seen: read on failure: a log, a screen, the messages so far.
        between: called between two polls instead of a pause of 10 ms, such as a step of a server.
        timeout: bound [s]. Pass another one only where the wait itself is under test.

    Raises:
        AssertionError: the condition never held; the text holds the last value of `seen`.
    """
    end = time.monotonic() + timeout
    while not (value := condition()):
        if time.monotonic() > end:
            raise AssertionError(f"no {what} within {timeout:g} s" + (f"; last seen:\n{seen()}" if seen else ""))
        time.sleep(0.01) if between is None else between()
    return value


def has_publisher(subscriber: Any) -> bool:
    """Return whether a publisher has answered the handshake of a rospy subscriber: it sends all messages from then on.

    `get_num_connections` counts a connection before the handshake, while the publisher may not know of it.
    Clients under the Python of ROS 1 get this function with their own source too.
    """
    return any(connection.header for connection in subscriber.impl.connections)
