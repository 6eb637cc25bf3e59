"""Target files for a robot: CSV and lines of JSON."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.clients.operators.playback import read_targets
from cellwright.util.errors import DescriptionError, UsageError
from fuzz.verdict import FindingError, check_lines, check_refusal

MAX_SIZE = 2000
WORDS = (
    "time",
    "positions",
    "gripper_right",
    "gripper_left",
    '{"time": ',
    '"positions": {',
    "NaN",
    "Infinity",
    "1e999",
)
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))


def seeds() -> Iterator[bytes]:
    """Yield a file in either format."""
    yield b"time,a,b,gripper_right\n0,0.1,,0\n0.5,0.2,0.3,1\n"
    yield b'time,"a ""b"", c"\r\n0,1\r\n'
    yield b'{"time": 0.0, "positions": {"a": 0.1, "gripper_right": 1}}\n{"time": 1, "positions": {}}\n'


def attempt(data: bytes) -> None:
    """Read the bytes in either format."""
    for kind in ("csv", "jsonl"):
        path = _FOLDER / f"targets.{kind}"
        path.write_bytes(data)
        try:
            found = read_targets(path)
        except DescriptionError as error:
            check_refusal(error, str(path))
            continue
        except UsageError as error:
            check_lines([error], [str(path)])
            continue
        times = [sample.time for sample in found.samples]
        values = [value for sample in found.samples for value in sample.values.values()]
        if times != sorted(times) or not all(map(math.isfinite, (*times, *values, found.duration))):
            raise FindingError("targets that no clock comes to")
        if not all(found.positions.values()) or found.first.keys() != found.positions.keys():
            raise FindingError("the state does not match the targets")
