"""Which way pictures are drawn, where somebody has settled it: the one place that looks at the environment for it."""

from __future__ import annotations

import os

from cellwright.util.errors import UsageError, did_you_mean, showable

WAY = "CELLWRIGHT_RENDERING"
"""Environment variable that settles how is drawn; unset or empty: by what works first."""

RAYS = "rays"
"""With no graphics library."""

CHOICES = ("egl", "osmesa", "cgl", "glfw", RAYS)
"""What it may be; `cgl` is for macOS, `glfw` for Windows. A way that the system has not comes down to what it has."""

_LONGEST = 40  # characters of what is told again


def settled_way() -> str:
    """The way that is settled; empty where none is.

    Raises:
        UsageError: there is no such way.
    """
    way = os.environ.get(WAY, "")
    if way and way not in CHOICES:
        said = showable(way, _LONGEST).replace("\n", " ")
        meant = did_you_mean(way.lower(), CHOICES)
        raise UsageError(f"{WAY}={said}: give one of {', '.join(CHOICES)}, or leave it unset{meant}")
    return way
