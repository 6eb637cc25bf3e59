"""A trial from any bytes, alone and behind another file: PyYAML's rules, bounds, encodings, lines."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.cell.checks.difficulty import difficulties
from cellwright.config.trial.gear2017 import TOP_LEVEL, load_trial, resolved
from cellwright.util.errors import DescriptionError
from fuzz import seeds as bundled
from fuzz.verdict import check_lines, check_refusal

MAX_SIZE = 6000
WORDS = (
    *TOP_LEVEL,
    *(
        "cellwright",
        "parts",
        "xyz",
        "rpy",
        "type",
        "pose",
        "models",
        "ur10",
        "<<",
        "&a",
        "*a",
        "!!python/name:os",
        "---",
    ),
    *("!!binary", "!!timestamp", "!!float", "!!set", "!!omap", ".nan", ".inf", "\t", "? ", "- ", "|", ">", "%YAML 1.1"),
)
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))
_FIRST = _FOLDER / "first.yaml"
_FIRST.write_text("arm: {type: ur10}\n")


def seeds() -> Iterator[bytes]:
    """Yield the trials, and texts that break YAML readers."""
    yield from bundled.files(*bundled.TRIALS)
    yield "time_limit: 500\n".encode("utf-16")
    yield b"\xef\xbb\xbforders: {}\r\noptions:\r\n  insert_agvs: no\r\n"
    yield b"a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n<<: {time_limit: 1}\n"


def attempt(data: bytes) -> None:
    """Load the bytes as a trial."""
    path = _FOLDER / "trial.yaml"
    path.write_bytes(data)
    for paths in ([path], [_FIRST, path]):
        load(paths)


def load(paths: list[Path]) -> None:
    """Load a trial; its description is valid JSON, and warnings have the form of refusals."""
    names = [str(path) for path in paths]
    try:
        loaded = load_trial(paths)
    except DescriptionError as error:
        check_refusal(error, *names)
        return
    check_lines(loaded.warnings, names)
    json.dumps(resolved(loaded), allow_nan=False)
    for demand in difficulties(loaded.trial):
        str(demand.text)
