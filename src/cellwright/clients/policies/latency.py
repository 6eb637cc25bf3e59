"""Latency of a policy: how long an answer takes in simulation time, from one of several sources.

A source gives one number a request, in the order of requests. Only `measured` asks the wall clock. All others depend on
the run's seed alone, and draw from a stream of their own, so that nothing else in the cell shifts their numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import cycle
from pathlib import Path
from typing import Protocol

from cellwright.engine.random_streams import generator
from cellwright.util.errors import UsageError

OPTION = "--latency"
STREAM = "latency"
"""Name of the random stream of drawn latencies, a child of the run's seed."""
WARM_UP = 1
"""Requests that `measured` sends with the first observation, and does not count: the first one compiles the model."""
LONGEST = 60.0
"""Largest latency [s]: a request that took longer counts as lost."""

_MILLISECONDS = Fraction(1, 1000)
_UNITS = {"ms": _MILLISECONDS, "s": Fraction(1)}
_NUMBER = r"\s*(\d{1,12}(?:\.\d{0,12})?|\.\d{1,12})\s*"
_TIME = re.compile(f"{_NUMBER}(ms|s)\\s*", re.ASCII)
_LINE = re.compile(_NUMBER, re.ASCII)
_FORMS = "120ms, uniform:60ms..180ms, normal:120ms,20ms, file:PATH, measured or measured:server"
_MAX_LINES = 1_000_000
_MAX_BYTES = 16 << 20


class Timed(Protocol):
    """Times of an answer."""

    @property
    def wall(self) -> float:
        """Wall time of the round trip [s]."""

    @property
    def infer_ms(self) -> float | None:
        """Time of inference as the server reports it [ms]; None if it does not."""


Source = Callable[[Timed], Fraction]
"""Returns the latency [s] of the next request, by its answer."""


class LatencyError(UsageError):
    """A measured latency is missing, or too large to count."""


@dataclass(frozen=True, slots=True)
class Latency:
    """Source of latencies, as written.

    Example:
        >>> latency = Latency.read("uniform:60ms..180ms")
        >>> source = latency.source(seed=1)
        >>> from cellwright.clients.policies.latency import in_ticks
        >>> 30 <= in_ticks(source(None), 2_000_000) <= 90
        True

    Attributes:
        kind: `fixed`, `uniform`, `normal`, `file` or `measured`.
        text: the source as written.
        times: its times [s]: of `fixed` one, of `uniform` the bounds, of `normal` mean and deviation, of `file` all.
        is_server: True if `measured` takes the server's own time of inference, and not the round trip.
    """

    kind: str
    text: str
    times: tuple[Fraction, ...] = ()
    is_server: bool = False

    @classmethod
    def read(cls, text: str) -> Latency:
        """Read a source: `120ms`, `uniform:60ms..180ms`, `normal:120ms,20ms`, `file:PATH`, `measured[:server]`.

        Raises:
            UsageError: it is none of these, a time is out of bounds, or the file is not as it should be.
        """
        kind, colon, rest = text.partition(":")
        match kind.strip() if colon or kind.strip() == "measured" else "":
            case "uniform":
                low, high = _times(text, rest, "..", "uniform:60ms..180ms")
                if low > high:
                    raise UsageError(f"{OPTION} {text}: the first time must not be above the second; exchange them")
                return cls("uniform", text, (low, high))
            case "normal":
                return cls("normal", text, _times(text, rest, ",", "normal:120ms,20ms"))
            case "file":
                return cls("file", text, _times_of_file(Path(rest)))
            case "measured" if rest in ("", "server"):
                return cls("measured", text, is_server=rest == "server")
        if _TIME.fullmatch(text):
            return cls("fixed", text, (_time(text, text),))
        raise UsageError(f"{OPTION} {text}: unknown source; give {_FORMS}")

    @property
    def is_measured(self) -> bool:
        """True if the wall clock decides."""
        return self.kind == "measured"

    def source(self, seed: int) -> Source:
        """Return the source for one run, by the run's seed."""
        if self.is_measured:
            return self._measured
        drawn = self._drawn(seed)
        return lambda _answer: next(drawn)

    def _drawn(self, seed: int) -> Iterator[Fraction]:
        if self.kind in ("fixed", "file"):
            yield from cycle(self.times)
        random = generator(seed, STREAM)
        first, second = map(float, self.times)
        while True:
            number = random.uniform(first, second) if self.kind == "uniform" else random.normal(first, second)
            yield _in_nanoseconds(min(max(0.0, number), LONGEST))

    def _measured(self, answer: Timed) -> Fraction:
        taken: float | None = answer.wall
        if self.is_server:
            taken = None if answer.infer_ms is None else answer.infer_ms / 1000.0
        if taken is None:
            raise LatencyError(
                f"{OPTION} {self.text}: the server reports no infer_ms; give measured, which takes the round trip"
            )
        if not 0.0 <= taken <= LONGEST:
            raise LatencyError(
                f"{OPTION} {self.text}: the answer took {taken:g} s, more than {LONGEST:g} s, and counts as lost"
            )
        return _in_nanoseconds(taken)


def in_ticks(latency: Fraction, tick: Fraction | int) -> int:
    """Return a latency [s] in whole ticks of `tick` [ns], rounded up: within a tick an answer changes nothing.

    Example:
        >>> in_ticks(Fraction(100, 1000), 2_000_000), in_ticks(Fraction(101, 1000), 2_000_000)
        (50, 51)
    """
    return math.ceil(latency * 1_000_000_000 / tick)


def _in_nanoseconds(time: float) -> Fraction:
    """Return a time [s] in whole nanoseconds: 0.1 s, which a float is not exactly, ends on its tick."""
    return Fraction(round(time * 1e9), 10**9)


def _time(text: str, written: str) -> Fraction:
    found = _TIME.fullmatch(written)
    if found is None:
        raise UsageError(f"{OPTION} {text}: must be a time with its unit (got {written!r:.40}); write it as 120ms")
    time = Fraction(found[1]) * _UNITS[found[2]]
    return _bounded(time, f"{OPTION} {text}")


def _bounded(time: Fraction, where: str) -> Fraction:
    if not 0 <= time <= LONGEST:
        raise UsageError(f"{where}: must be from 0 to {LONGEST:g} s (got {float(time):g} s)")
    return time


def _times(text: str, written: str, separator: str, example: str) -> tuple[Fraction, Fraction]:
    first, found, second = written.partition(separator)
    if not found:
        raise UsageError(f"{OPTION} {text}: must have two times; write it as {example}")
    if _TIME.fullmatch(second) and not _TIME.fullmatch(first):
        first += second[-2:] if second.strip().endswith("ms") else "s"  # 60..180ms
    return _time(text, first), _time(text, second)


def _times_of_file(path: Path) -> tuple[Fraction, ...]:
    """Return the times in a file with a number of milliseconds a line, in their order; they repeat at its end."""
    try:
        if not path.is_file():
            raise UsageError(f"{OPTION} file:{path}: there is no such file")
        if path.stat().st_size > _MAX_BYTES:
            raise UsageError(f"{OPTION} file:{path}: is larger than {_MAX_BYTES >> 20} MiB; give fewer lines")
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise UsageError(f"{OPTION} file:{path}: cannot be read: {error.strerror}") from None
    times = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        found = _LINE.fullmatch(line)
        if found is None:
            raise UsageError(f"{path}:{number}: must be a number of milliseconds (got {line.strip()!r:.40})")
        times.append(_bounded(Fraction(found[1]) * _MILLISECONDS, f"{path}:{number}"))
    if not times or len(times) > _MAX_LINES:
        raise UsageError(f"{path}: must have 1 to {_MAX_LINES} lines with milliseconds (got {len(times)})")
    return tuple(times)
