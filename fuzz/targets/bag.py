"""Recordings of ROS 1: damaged bags are refused in one line."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from cellwright.clients.operators.bags import read_bag
from cellwright.util.errors import UsageError
from fuzz.verdict import FindingError, check_lines

MAX_SIZE = 20_000
WORDS = (
    "#ROSBAG V2.0\n",
    "op=",
    "conn=",
    "topic=",
    "chunk_pos=",
    "compression=",
    "bz2",
    "lz4",
    "none",
    "size=",
    "/joint_cmd",
)
_PATH = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-")) / "targets.bag"


def seeds() -> Iterator[bytes]:
    """Yield small recordings, one for each kind of compression."""
    store = get_typestore(Stores.ROS1_NOETIC)
    state = store.types["sensor_msgs/msg/JointState"]
    header = store.types["std_msgs/msg/Header"]
    stamp = store.types["builtin_interfaces/msg/Time"]
    for compression in (None, *Writer.CompressionFormat):
        path = _PATH.with_name(f"seed-{compression}.bag")
        path.unlink(missing_ok=True)
        writer = Writer(path)
        if compression is not None:
            writer.set_compression(compression)
        with writer:
            connection = writer.add_connection("/io_teleop/joint_cmd", state.__msgtype__, typestore=store)
            for k in range(3):
                nothing = np.array([], np.float64)
                said = state(header(k, stamp(k, 0), ""), ["a", "b"], np.array([0.1, 0.2 * k]), nothing, nothing)
                content = store.serialize_ros1(said, state.__msgtype__)
                writer.write(connection, k * 10**9, bytes(content))
        yield path.read_bytes()


def attempt(data: bytes) -> None:
    """Read the bytes as a bag."""
    _PATH.write_bytes(data)
    try:
        found = read_bag(_PATH)
    except UsageError as error:
        check_lines([error], [str(_PATH)])
        return
    times = [sample.time for sample in found.samples]
    if times != sorted(times) or not all(map(math.isfinite, times)):
        raise FindingError("targets that no clock comes to")
