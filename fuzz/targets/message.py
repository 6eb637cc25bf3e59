"""Messages and requests from outside: bytes are a message of the topic's type, or refused in one line."""

from __future__ import annotations

from collections.abc import Iterator

from cellwright.cell.interface.rows import GEAR
from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import EndpointKind
from cellwright.middleware.messages import TYPES, Message
from cellwright.middleware.messages.conversions import joint_state, joint_trajectory, trajectory_point
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.middleware.messages.standard import GoalID, Time
from cellwright.robot.interface import IO_TELEOP
from cellwright.util.errors import MessageError
from fuzz.verdict import FindingError

MAX_SIZE = 4000
WORDS = (
    "elbow_joint",
    "linear_arm_actuator_joint",
    "order_0_kit_0",
    "\0\0\0\1",
    "\xff\xff\xff\x7f",
    "\xff\xff\xff\xff",
)

_HEARD = [row for row in (*GEAR, *IO_TELEOP) if row.direction is Direction.IN and row.kind is not EndpointKind.ACTION]
CLASSES: list[type[Message]] = sorted(
    {
        TYPES.service(row.type).request if row.kind is EndpointKind.SERVICE else TYPES.message(row.type)
        for row in _HEARD
    },
    key=lambda each: each.__msgtype__,
)
"""Types of all messages that either interface receives."""


def seeds() -> Iterator[bytes]:
    """Yield messages of several types in both encodings, prefixed with the numbers of type and encoding."""
    point = trajectory_point([0.1] * 7, time_from_start=10**9)
    for message in (
        joint_trajectory(["elbow_joint"] * 7, [point] * 3),
        joint_state(["waist"], [0.5], time=5),
        AGVControlRequest("order_0_kit_0"),
        GoalID(Time(1, 2), "goal"),
    ):
        number = CLASSES.index(type(message))
        yield bytes([number, 0]) + TYPES.to_cdr(message)
        yield bytes([number, 1]) + TYPES.to_ros1(message)


def attempt(data: bytes) -> None:
    """Read the bytes as a message, and encode the result."""
    if len(data) < 2:
        return
    message_class = CLASSES[data[0] % len(CLASSES)]
    read, write = (TYPES.from_ros1, TYPES.to_ros1) if data[1] % 2 else (TYPES.from_cdr, TYPES.to_cdr)
    try:
        message = TYPES.checked(read(data[2:], message_class))
    except MessageError as error:
        if not str(error) or len(str(error)) > 500 or not str(error).isprintable():
            raise FindingError(f"a refusal that cannot be read: {str(error)!r:.300}") from None
        return
    if type(message) is not message_class:
        raise FindingError(f"{message_class.__msgtype__} has become {type(message)}")
    if write(TYPES.checked(read(write(message), message_class))) != write(message):
        raise FindingError("it does not survive being written and read")
