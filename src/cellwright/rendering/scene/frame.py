"""Where the bodies of a scene are at one moment, and how that travels as bytes."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose

_HEAD = struct.Struct("<BqII")  # whole or changes; time; bodies; entries that follow
_WHOLE, _CHANGES = 0, 1
_ENTRY = np.dtype([("body", "<u4"), ("shown", "u1"), ("pose", "<f4", (7,))])
MOST_BODIES = 100_000
"""More bodies are not taken from outside."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Where the bodies of a scene are.

    Attributes:
        time: simulation time [ns].
        poses: (bodies, 7) x, y, z [m] and quaternion w, x, y, z of each body in the world, in the order of
            `Scene.bodies`; float32. The world's own is the identity.
        shown: (bodies,) whether each is there to be seen; a part that is not in play is not.
    """

    time: int
    poses: NDArray[np.float32]
    shown: NDArray[np.bool_]

    def pose(self, body: int) -> Pose:
        """world_T_body of a body."""
        x, y, z, qw, qx, qy, qz = self.poses[body].tolist()
        return Pose((x, y, z), (qw, qx, qy, qz))

    def placed(self, body: int, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 3) [m] in the frame of a body, in the world."""
        place, scalar, vector = np.split(self.poses[body].astype(np.float64), (3, 4))
        across = 2 * np.cross(vector, points)
        found: NDArray[np.float64] = points + scalar * across + np.cross(vector, across) + place
        return found

    def encode(self, before: Frame | None = None) -> bytes:
        """As bytes; with a frame `before` of the same scene, only what has changed since then."""
        count = len(self.poses)
        if before is None or len(before.poses) != count:
            kind, bodies = _WHOLE, np.arange(count)
        else:
            changed = (self.poses != before.poses).any(axis=1)
            if self.shown is not before.shown:  # the same array, mostly
                changed |= self.shown != before.shown
            kind, bodies = _CHANGES, changed.nonzero()[0]
        entries = np.empty(len(bodies), _ENTRY)
        entries["body"], entries["shown"], entries["pose"] = bodies, self.shown[bodies], self.poses[bodies]
        return _HEAD.pack(kind, self.time, count, len(bodies)) + entries.tobytes()


def decode(data: bytes | memoryview, before: Frame | None = None) -> Frame:
    """The frame in these bytes; `before` is the one that came before it, for those that hold changes.

    Raises:
        MessageError: the bytes are no frame, or hold changes to a frame that is not there.
    """
    try:
        kind, time, count, changed = _HEAD.unpack_from(data)
        entries = np.frombuffer(data, _ENTRY, changed, _HEAD.size)
    except (struct.error, ValueError):
        raise MessageError(f"these {len(data)} bytes are no frame of a scene") from None
    if len(data) != _HEAD.size + entries.nbytes or count > MOST_BODIES or kind not in (_WHOLE, _CHANGES):
        raise MessageError(f"these {len(data)} bytes are no frame of a scene")
    if kind == _WHOLE:
        is_fitting = np.array_equal(entries["body"], np.arange(count))
    else:
        is_fitting = before is not None and len(before.poses) == count and bool((entries["body"] < count).all())
    if not is_fitting or not np.isfinite(entries["pose"]).all():
        raise MessageError("a frame of a scene that does not fit the one before it")
    if kind == _WHOLE or before is None:
        return Frame(time, entries["pose"].copy(), entries["shown"] != 0)
    poses, shown = before.poses.copy(), before.shown.copy()
    poses[entries["body"]] = entries["pose"]
    shown[entries["body"]] = entries["shown"] != 0
    return Frame(time, poses, shown)


def is_whole(data: bytes | memoryview) -> bool:
    """Whether the bytes of a frame hold all bodies, and need none before them."""
    return len(data) >= _HEAD.size and data[0] == _WHOLE
