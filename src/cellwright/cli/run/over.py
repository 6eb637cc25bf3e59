"""The way between agent and cell that `cellwright run` is told, where they are in different processes."""

from __future__ import annotations

from cellwright.cli import options

WAYS = ("socket", "ros1")
"""Ways between an agent and a cell that are in different processes."""


def way(over: str | None, *, lockstep: bool) -> str | None:
    """The way between agent and cell; None within one process."""
    if over is None and lockstep:
        options.refuse(f"--lockstep: say over what as well, such as --over {WAYS[0]}; in one process it is always so")
    if over is not None and over not in WAYS:
        options.refuse(f"--over {over}: give {' or '.join(WAYS)}")
    return over
