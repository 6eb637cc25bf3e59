"""Memory of the processes of an evaluation: its limit, how much they have, and whether the machine had none left."""

import sys
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path

MEMORY_IS_LIMITED = sys.platform == "linux"
"""True if this system can limit and report the memory of a process."""


def limit_memory(max_bytes: int) -> None:
    """Limit the memory of this process to `max_bytes`: an allocation beyond that raises an error."""
    if sys.platform == "linux":
        import resource  # not on Windows

        resource.setrlimit(resource.RLIMIT_DATA, (max_bytes, max_bytes))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def memory_below(roots: Collection[int]) -> Mapping[int, int]:
    """Return the resident memory [bytes] of all descendants of each process, by its id; empty where unknown."""
    if sys.platform != "linux" or not roots:
        return {}
    import resource

    page = resource.getpagesize()
    parents, own = {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_bytes().rpartition(b")")[2].split()
            except OSError:
                continue  # the process has just ended
            parents[int(entry.name)], own[int(entry.name)] = int(fields[1]), int(fields[21]) * page
    total = dict.fromkeys(roots, 0)
    for process, memory in own.items():
        above = parents[process]
        for _ in range(len(parents)):  # a process that ended meanwhile may have left a circle of reused ids
            if above in total:
                total[above] += memory
            if above not in parents:
                break
            above = parents[above]
    return total


def oom_kills() -> int:
    """Return how many processes the kernel of this machine has killed so far for want of memory; 0 where unknown."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/vmstat").read_text(encoding="ascii").splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0
