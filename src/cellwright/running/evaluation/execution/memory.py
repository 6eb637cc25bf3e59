"""Memory and processor time of the processes of an evaluation: the limit, the usage, and the want of a machine."""

import os
import sys
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

MEMORY_IS_LIMITED = sys.platform == "linux"
"""True if this system can limit and report the memory of a process."""

_STATE, _PARENT, _TIMES, _THREADS, _RSS = 0, 1, slice(11, 15), 17, 21
"""Places in the file `stat` of a process, behind its name; the times are its own and its children's."""


def limit_memory(max_bytes: int) -> None:
    """Limit the memory of this process to `max_bytes`: an allocation beyond that raises an error."""
    if sys.platform == "linux":
        import resource  # not on Windows

        resource.setrlimit(resource.RLIMIT_DATA, (max_bytes, max_bytes))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


@dataclass(frozen=True, slots=True)
class Usage:
    """Usage of memory and processors by a process and its descendants.

    Attributes:
        memory: resident memory [bytes].
        processor: processor time so far [s], with that of children that have ended.
        is_held_up: True if one of them has work now: it computes, or waits for a processor or a disk.
        members: ids of the descendants.
    """

    memory: int = 0
    processor: float = 0.0
    is_held_up: bool = False
    members: tuple[int, ...] = ()


def usage_below(roots: Collection[int]) -> Mapping[int, Usage]:
    """Return the usage of each process with all its descendants, by its id; empty where unknown.

    The process itself, which is a guard as a rule, counts in all but the memory.
    """
    if sys.platform != "linux" or not roots:
        return {}
    import resource

    page, tick = resource.getpagesize(), os.sysconf("SC_CLK_TCK")
    found: dict[int, list[bytes]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with suppress(OSError):  # the process has just ended
                found[int(entry.name)] = _fields(entry / "stat")
    total = dict.fromkeys(roots, Usage())
    for process, fields in found.items():
        own = Usage(int(fields[_RSS]) * page, sum(map(int, fields[_TIMES])) / tick, members=(process,))
        is_held_up: bool | None = None
        above = process
        # a process that ended meanwhile may have left a circle of reused ids
        for _ in range(len(found)):
            if above in total:
                is_held_up = _has_work(process, fields) if is_held_up is None else is_held_up
                counted = replace(own, memory=0) if above == process else own
                total[above] = _sum(total[above], replace(counted, is_held_up=is_held_up))
            if above not in found:
                break
            above = int(found[above][_PARENT])
    return total


def _fields(stat: Path) -> list[bytes]:
    return stat.read_bytes().rpartition(b")")[2].split()


def _sum(one: Usage, other: Usage) -> Usage:
    return Usage(
        one.memory + other.memory,
        one.processor + other.processor,
        one.is_held_up or other.is_held_up,
        one.members + other.members,
    )


def _has_work(process: int, fields: list[bytes]) -> bool:
    """Return whether a thread of a process computes, or waits for a processor or a disk."""
    states = [fields[_STATE]]
    if int(fields[_THREADS]) > 1:
        with suppress(OSError):  # it has just ended
            for thread in Path(f"/proc/{process}/task").iterdir():
                with suppress(OSError):
                    states.append(_fields(thread / "stat")[_STATE])
    return any(state in (b"R", b"D") for state in states)


class OwnTime:
    """Time that a run has taken of its own accord [s], without what the machine kept it from working.

    While it computes, its processor time counts; while all of it sleeps, wall time. It is never more than wall time.

    Example:
        >>> clock = OwnTime(10.0, Usage())
        >>> clock.take(11.0, Usage(processor=0.2, is_held_up=True))  # it waited for a processor
        0.2
        >>> clock.take(13.0, Usage(processor=0.2))  # it slept
        2.2
    """

    def __init__(self, now: float, usage: Usage) -> None:
        self._now, self._processor, self.value = now, usage.processor, 0.0

    def take(self, now: float, usage: Usage) -> float:
        """Take the usage at a wall time [s], and return the time up to then."""
        passed, used = now - self._now, max(0.0, usage.processor - self._processor)
        # Several processors may be used at once: more than the wall time must not count.
        self.value += min(passed, used) if usage.is_held_up else passed
        self._now, self._processor = now, usage.processor
        return self.value


def oom_kills() -> int:
    """Return how many processes the kernel of this machine has killed so far for want of memory; 0 where unknown."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/vmstat").read_text(encoding="ascii").splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0
