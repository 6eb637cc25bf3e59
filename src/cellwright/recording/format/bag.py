"""A ROS 1 bag of a recording: all that was said on the bus, in the ROS 1 form, for the tools of ROS 1."""

from collections.abc import Callable
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer, WriterError

from cellwright.middleware.messages import definition, full_name, md5, to_ros1
from cellwright.recording.format.reader import Recording, TimeRange
from cellwright.util.errors import CellwrightError, UsageError
from cellwright.util.files import in_its_place

_EARLIEST = 1
"""[ns]: `rosbag play` passes over what is said at 0, such as the fixed frames."""


def write_bag(
    recording: Path,
    bag: Path,
    *,
    start: int | None = None,
    until: int | None = None,
    tell: Callable[[float], None] | None = None,
) -> list[str]:
    """Make a bag of a recording; one that is there already is replaced when the new one is whole.

    What Cellwright adds to recordings stays behind: a bag can be listened to, and not be run again. A bag that begins
    later, at `start` [ns], begins with what is latched then, as its listeners would have been told; it goes up to
    `until` [ns]. `tell` takes now and then how far it is, 0..1.

    Returns:
        Topics that are left out, since their types have another form in ROS 1.

    Raises:
        RecordingError: the recording cannot be read.
        UsageError: the bag cannot be written.
    """
    try:
        with Recording(recording) as source, in_its_place(bag) as unfinished:
            return _write(source, unfinished, TimeRange(source, start, until), tell)
    except (OSError, WriterError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        raise UsageError(f"{bag}: cannot be written: {reason or error}") from None


def _write(source: Recording, path: Path, span: TimeRange, tell: Callable[[float], None] | None) -> list[str]:
    connections: dict[str, Connection] = {}
    left_out = []
    with Writer(path) as writer:
        for name, topic in source.topics.items():
            if topic.is_own:
                continue
            try:
                text, checksum = definition(topic.type), md5(topic.type)
            except CellwrightError:
                left_out.append(name)
                continue
            connections[name] = writer.add_connection(
                name,
                full_name(topic.type),
                msgdef=text,
                md5sum=checksum,
                callerid=topic.node or None,
                latching=int(topic.latch),
            )
        before: dict[str, tuple[bytes, bytes]] = {}  # states are said over and over
        for message in span.messages(connections, tell):
            cdr, data = before.get(message.topic, (b"", b""))
            if message.data != cdr:
                data = to_ros1(source.decode(message))
                before[message.topic] = message.data, data
            writer.write(connections[message.topic], max(message.time, _EARLIEST), data)
    return left_out
