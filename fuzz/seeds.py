"""What the search begins with: the files that come with Cellwright and its documentation."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CASES = ROOT / "tests" / "data" / "fuzz"
"""Inputs that were findings once, a folder for each target; tests go through them, and the search begins with them."""


def files(*patterns: str, largest: int = 1 << 16) -> Iterator[bytes]:
    """The contents of the project's files of these patterns, the large ones left out."""
    for pattern in patterns:
        for path in sorted(ROOT.glob(pattern)):
            if path.is_file() and path.stat().st_size <= largest:
                yield path.read_bytes()


def cases(target: str) -> list[Path]:
    """The inputs that were findings of a target once."""
    return sorted(path for path in (CASES / target).glob("*") if path.is_file())


TRIALS = (
    "src/cellwright/config/trial/catalogue/*.yaml",
    "src/cellwright/middleware/ros1/packages/data/*/config/*.yaml",
    "examples/**/*.yaml",
    "docs/examples/**/*.yaml",
)
"""Where trials are."""
