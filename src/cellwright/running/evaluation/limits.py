"""What a run may use, and how its use of memory is seen and bounded."""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

MEBIBYTE = 1 << 20


@dataclass(frozen=True, slots=True)
class Limits:
    """What one run may use at most.

    Attributes:
        wall: time on the wall clock [s].
        memory: memory [bytes] of its process, and of the processes that it has started; held on Linux only.
        log: what it may write to its log [bytes].
    """

    wall: float = 600.0
    memory: int = 2048 * MEBIBYTE
    log: int = 16 * MEBIBYTE


MEMORY_IS_LIMITED = sys.platform == "linux"
"""Whether this system lets the memory of a process be bounded and seen."""


def limit_memory(most: int) -> None:
    """Let this process have no more than `most` bytes of memory: what asks for more gets an error instead."""
    if sys.platform == "linux":
        import resource  # there is none on Windows

        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def memory_of_sessions() -> Counter[int]:
    """Resident memory [bytes] of every session of processes, by its leader's number; empty where it cannot be seen."""
    total: Counter[int] = Counter()
    if sys.platform == "linux":
        import resource

        page = resource.getpagesize()
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    fields = (entry / "stat").read_bytes().rpartition(b")")[2].split()
                except OSError:
                    continue  # it has just ended
                total[int(fields[3])] += int(fields[21]) * page
    return total
