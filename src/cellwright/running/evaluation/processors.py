"""How much can be worked at the same time."""

from __future__ import annotations

import os


def usable_processors() -> int:
    """How many processors this process may use: a container may have fewer than the machine."""
    allowed = getattr(os, "sched_getaffinity", None)  # on Linux alone
    return os.cpu_count() or 1 if allowed is None else len(allowed(0))
