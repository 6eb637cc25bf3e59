"""Publications that need no message object while all listeners take CDR, as a recorder does.

Their messages have a shape that stays, with numbers that change; see `CdrTemplates`.
"""

from collections.abc import Callable, Sequence
from functools import cache

from cellwright.cell.devices.arm import Arm
from cellwright.cell.interface.frames import Link, transforms
from cellwright.engine.clock import Clock
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.control_msgs import JointTrajectoryControllerState
from cellwright.middleware.messages.conversions import header, joint_state, trajectory_point
from cellwright.middleware.messages.standard import TFMessage
from cellwright.middleware.messages.template import CdrTemplates
from cellwright.util.pose import Pose

POSE_FIELDS = ("x", "y", "z", "w")
"""Fields of the numbers of poses: those of points, vectors and quaternions."""


def sample_links(output: Output, read: Callable[[], list[Link]]) -> None:
    """Publish the frames of links that a function returns, the same links each time."""
    time, templates = output.simulation.clock.message_time, CdrTemplates(output.bus.types, POSE_FIELDS)

    def build() -> Message:
        return TFMessage(transforms(read(), time()))

    def encode() -> bytes:
        numbers = [n for _, _, position, (w, x, y, z) in read() for n in (*position, x, y, z, w)]
        return templates.filled(None, build, time(), numbers)

    output.sample(build, encode)


def sample_joints(output: Output, names: list[str], columns: Callable[[], list[list[float]]], clock: Clock) -> None:
    """Publish joint states from a function that returns positions, velocities and efforts of the named joints."""
    templates = CdrTemplates(output.bus.types, ("position", "velocity", "effort"))

    def build() -> Message:
        return joint_state(names, *columns(), time=clock.message_time())

    def encode() -> bytes:
        return templates.filled(None, build, clock.message_time(), [each for column in columns() for each in column])

    output.sample(build, encode)


def sample_following(output: Output, arm: Arm) -> None:
    """Publish desired and actual state of the joints of an arm."""
    clock = arm.simulation.clock
    templates = CdrTemplates(output.bus.types, ("positions", "velocities", "accelerations"))

    def build() -> Message:
        points = (trajectory_point(*each) for each in arm.following())
        return JointTrajectoryControllerState(header("", clock.message_time()), list(arm.joints), *points)

    def encode() -> bytes:
        numbers = [number for point in arm.following() for column in point for number in column]
        return templates.filled(None, build, clock.message_time(), numbers)

    output.sample(build, encode)


def made_once(make: Callable[..., Message], output: Output) -> tuple[Callable[..., Message], Callable[..., bytes]]:
    """Return functions that make the message of some values, and its CDR, once for each combination of them."""
    return cache(make), cache(lambda *values: output.bus.types.to_cdr(make(*values)))


def pose_numbers(poses: Sequence[Pose]) -> list[float]:
    """Return the numbers of poses in the order of their messages."""
    return [number for each in poses for number in (*each.position, *each.quaternion[1:], each.quaternion[0])]
