"""Access to a cell over ROS 1 without a client's process: the newest message of a topic, the response of a service."""

from __future__ import annotations

from contextlib import closing

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.types import M
from tests.middleware.ros1.bridge.wire import Calls, subscribe
from tests.ros1.ground import Ground


def glance(ground: Ground, topic: str, kind: type[M], count: int = 1, *, node: str = "/gazebo") -> list[M]:
    """Return the next messages of a topic.

    Args:
        ground: environment of the cell.
        topic: its full name.
        kind: type of the messages.
        count: number of messages.
        node: the publisher.
    """
    with closing(subscribe(ground, topic, node=node)) as connection:
        return [TYPES.from_ros1(connection.piece(), kind) for _ in range(count)]


def answer(ground: Ground, service: str, request: bytes) -> bytes:
    """Return the response of a service that succeeds.

    Args:
        ground: environment of the cell.
        service: its full name.
        request: its bytes.
    """
    with closing(Calls(ground, service)) as calls:
        succeeded, response = calls.call(request)
    assert succeeded, response
    return response
