"""ROS 1 bag export of a recording: all messages of the bus in the ROS 1 form, for the tools of ROS 1."""

from collections.abc import Callable
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer, WriterError

from cellwright.middleware.messages import full_name
from cellwright.recording.format.reader import RecordingFile, TimeRange
from cellwright.util.errors import CellwrightError, UsageError
from cellwright.util.files import replacement_path

_EARLIEST = 1
"""Earliest time in a bag [ns]: `rosbag play` ignores messages at time 0, such as the fixed frames."""


def write_bag(
    recording: Path,
    bag: Path,
    *,
    start: int | None = None,
    until: int | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> list[str]:
    """Write a ROS 1 bag of a recording. An existing file is replaced once the new one is complete.

    The topics that Cellwright adds to recordings are left out: a bag can be played, but not run again.

    Args:
        recording: the MCAP file.
        bag: the bag to write.
        start: first time [ns]; a bag that begins later than the recording begins with the messages that are latched
            then.
        until: last time [ns].
        on_progress: called now and then with the finished share, 0..1.

    Returns:
        Topics that are left out, since their types have another form in ROS 1.

    Raises:
        RecordingError: the recording cannot be read.
        UsageError: the bag cannot be written.
    """
    try:
        with RecordingFile(recording) as source, replacement_path(bag) as unfinished:
            return _write(source, unfinished, TimeRange(source, start, until), on_progress)
    except (OSError, WriterError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        raise UsageError(f"{bag}: cannot be written: {reason or error}") from None


def _write(
    source: RecordingFile, path: Path, span: TimeRange, on_progress: Callable[[float], None] | None
) -> list[str]:
    connections: dict[str, Connection] = {}
    left_out = []
    with Writer(path) as writer:
        for name, topic in source.topics.items():
            if topic.is_own:
                continue
            try:
                text, checksum = source.types.definition(topic.type), source.types.md5(topic.type)
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
        before: dict[str, tuple[bytes, bytes]] = {}  # states are often published unchanged
        for message in span.messages(connections, on_progress):
            cdr, data = before.get(message.topic, (b"", b""))
            if message.data != cdr:
                data = source.types.to_ros1(source.decode(message))
                before[message.topic] = message.data, data
            writer.write(connections[message.topic], max(message.time, _EARLIEST), data)
    return left_out
