"""Answers of the services for viewers, as a page reads them: scenes, whole frames and changes."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind, data_frame
from cellwright.rendering.scene.scene import (
    Scene,
    SceneFrame,
    SceneShape,
    ShapeLayer,
    ShapeType,
    decode_frame,
    decode_scene,
    encode_scene,
)
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose
from fuzz.verdict import FindingError

MAX_SIZE = 3000
WORDS = ("sequence", "digest", "about", "\0\0\0\0", "\2\0\0\0", "\1\0\0\0", "{}")
_POSES = np.array([[0, 0, 0, 1, 0, 0, 0]] * 3, np.float32)
_BEFORE = SceneFrame(0, _POSES, np.ones(3, bool))
_SHAPE = SceneShape(1, ShapeType.SPHERE, (0.1, 0.0, 0.0), Pose(), (1.0, 0.0, 0.0, 1.0), ShapeLayer.BOTH)


def seeds() -> Iterator[bytes]:
    """Yield a scene, a whole frame, and changes."""
    moved = SceneFrame(1, _POSES + np.float32(0.5), np.array([True, True, False]))
    for data in (
        encode_scene(Scene("small", ("world", "ball", "part"), (_SHAPE,), ())),
        _BEFORE.encode(),
        moved.encode(_BEFORE),
        _BEFORE.encode(_BEFORE),
    ):
        yield data_frame(0, {"sequence": 1, "digest": "a"}, data).payload
    yield struct.pack("<I", 1 << 31) + b"{}"


def attempt(data: bytes) -> None:
    """Read the bytes as the payload of an answer, and the data after its JSON as a scene and as a frame."""
    try:
        said, rest = Frame(FrameKind.DATA, payload=data).data()
    except FrameError as error:
        if not str(error).isprintable():
            raise FindingError(f"a line that cannot be read: {error!s:.200}") from None
        return
    if not isinstance(said, dict) or len(rest) > len(data) - 4:
        raise FindingError("an answer that was not sent")
    with suppress(MessageError):
        decode_scene(bytes(rest))
    for before in (None, _BEFORE):
        try:
            frame = decode_frame(rest, before)
        except MessageError:
            continue
        if not np.isfinite(frame.poses).all() or frame.poses.shape != (len(frame.shown), 7):
            raise FindingError("bodies that are nowhere")
