"""A ROS 1 bag of a recording: all that was said on the bus, in the ROS 1 form, for the tools of ROS 1."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer, WriterError

from cellwright.errors import CellwrightError, UsageError
from cellwright.messages import definition, full_name, md5, to_ros1
from cellwright.recording.reader import Recording


def write_bag(recording: Path, bag: Path) -> list[str]:
    """Make a bag of a recording; one that is there already is replaced when the new one is whole.

    What Cellwright adds to recordings stays behind: a bag can be listened to, and not be run again.

    Args:
        recording: the recording's file.
        bag: the bag's.

    Returns:
        Topics that are left out, since their types have another form in ROS 1.

    Raises:
        RecordingError: the recording cannot be read.
        UsageError: the bag cannot be written.
    """
    unfinished = bag.with_name(f".{os.getpid()}-{bag.name}.part")
    try:
        with Recording(recording) as source:
            left_out = _write(source, unfinished)
        os.replace(unfinished, bag)
    except (OSError, WriterError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        raise UsageError(f"{bag}: cannot be written: {reason or error}") from None
    finally:
        with suppress(OSError):
            unfinished.unlink()
    return left_out


def _write(source: Recording, path: Path) -> list[str]:
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
        for message in source.messages(connections):
            cdr, data = before.get(message.topic, (b"", b""))
            if message.data != cdr:
                data = to_ros1(source.decode(message))
                before[message.topic] = message.data, data
            writer.write(connections[message.topic], message.time, data)
    return left_out
