"""Seeds of the search: the files bundled with Cellwright and its documentation."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CASES = ROOT / "tests" / "data" / "fuzz"
"""Inputs of former findings, a folder for each target; tests run them, and the search begins with them."""

TRIALS = (
    "src/cellwright/config/trial/catalogue/*.yaml",
    "src/cellwright/middleware/ros1/packages/data/*/config/*.yaml",
    "examples/**/*.yaml",
    "docs/examples/**/*.yaml",
)
"""Patterns of trials."""


def files(*patterns: str, max_size: int = 1 << 16) -> Iterator[bytes]:
    """Yield the contents of the project's files of these patterns, except files above `max_size` [bytes]."""
    for pattern in patterns:
        for path in sorted(ROOT.glob(pattern)):
            if path.is_file() and path.stat().st_size <= max_size:
                yield path.read_bytes()


def cases(target: str) -> list[Path]:
    """Return the inputs of a target's former findings."""
    return sorted(path for path in (CASES / target).glob("*") if path.is_file())
