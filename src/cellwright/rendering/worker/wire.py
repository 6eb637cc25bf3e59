"""How a process that draws is started, and what goes through the pipes to and from it: a head of JSON, and bytes."""

from __future__ import annotations

import json
import struct
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

import cellwright
from cellwright.rendering.camera import Camera

_LENGTHS = struct.Struct("<II")
_PROGRAM = "import sys; sys.path.append(sys.argv[1]); from cellwright.rendering.worker.program import main; main()"


def command(ways: Iterable[str] = ()) -> list[str]:
    """The command of a process that draws.

    Args:
        ways: those that it tries, in order; none: as is settled, or all that there are.
    """
    return [sys.executable, "-P", "-c", _PROGRAM, str(Path(cellwright.__file__).parents[1]), *ways]


def write(pipe: BinaryIO, head: dict[str, Any], payload: bytes | memoryview = b"") -> None:
    """Send a head and bytes.

    Raises:
        OSError: nobody reads them any more.
    """
    said = json.dumps(head).encode()
    pipe.write(_LENGTHS.pack(len(said), len(payload)) + said)
    pipe.write(payload)
    pipe.flush()


def read(pipe: BinaryIO) -> tuple[dict[str, Any], bytes] | None:
    """A head and bytes; None at the end."""
    lengths = pipe.read(_LENGTHS.size)
    if len(lengths) < _LENGTHS.size:
        return None
    head_length, length = _LENGTHS.unpack(lengths)
    head, payload = pipe.read(head_length), pipe.read(length)
    if len(head) < head_length or len(payload) < length:
        return None
    found: dict[str, Any] = json.loads(head)
    return found, payload


def of_camera(camera: Camera) -> dict[str, Any]:
    """A camera as JSON."""
    return {"eye": camera.eye, "target": camera.target, "up": camera.up, "fov": camera.fov}


def to_camera(said: dict[str, Any]) -> Camera:
    """The camera that was said."""
    return Camera(tuple(said["eye"]), tuple(said["target"]), tuple(said["up"]), said["fov"])
