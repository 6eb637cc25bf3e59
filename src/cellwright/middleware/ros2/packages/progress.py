"""Progress of an installation: lines on what is done, and an estimate of the time left."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping
from typing import Self, TextIO

_INTERVALS = {False: 10.0, True: 0.5}
"""Time between estimates [s], elsewhere and on a terminal."""


_PRIOR = 3.0
"""Time of work as fast as on an idle machine [s], that is added to what was measured: the first second tells little."""


class Progress:
    """Lines and estimates of an installation; a terminal shows the estimate in a line that changes.

    Use it in a `with`, which shows an estimate from time to time. Without that it shows none.

    Args:
        stream: takes the lines, such as `sys.stdout`.
        name: begin of each line.
        now: clock [s].

    Example:
        >>> import sys
        >>> with Progress(sys.stdout, "install") as progress:
        ...     progress.plan({"download": 40.0, "build": 20.0})
        ...     progress.begin("download")
        ...     progress.end("download")
        ...     progress.say("downloaded")
        install: downloaded
    """

    def __init__(self, stream: TextIO, name: str, now: Callable[[], float] = time.monotonic) -> None:
        self._stream, self._name, self._now = stream, name, now
        self._is_terminal = stream.isatty()
        self._expected: dict[str, float] = {}
        self._begun: dict[str, float] = {}
        self._taken: dict[str, float] = {}
        self._shares: dict[str, float] = {}
        self._started: float | None = None
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._show, name="progress", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def say(self, line: str) -> None:
        """Write a line that stays."""
        self._write(line, stays=True)

    def plan(self, expected: Mapping[str, float]) -> None:
        """Add steps, with the time that each takes on an idle machine [s]."""
        with self._lock:
            self._expected |= expected

    def begin(self, name: str) -> None:
        """Count a step as running; several may run at once."""
        with self._lock:
            self._begun[name] = self._now()
            self._started = self._begun[name] if self._started is None else self._started

    def end(self, name: str) -> None:
        """Count a running step as done."""
        with self._lock:
            self._taken[name] = self._now() - self._begun.pop(name)

    def at(self, name: str, share: float) -> None:
        """Note the share of a running step that is done, at least."""
        with self._lock:
            self._shares[name] = share

    def estimate(self) -> tuple[float, float] | None:
        """Return the share of all steps that is done, and the time left [s]; None before the first step.

        A running step is taken to be as slow as those that are done were; it comes ever closer to its end.
        """
        with self._lock:
            if self._started is None:
                return None
            now, total = self._now(), sum(self._expected.values())
            done = sum(self._expected[name] for name in self._taken)
            pace = sum(self._taken.values()) / done if done else 1.0
            for name, begun in self._begun.items():
                by_time = 1.0 - math.exp(-2.0 * (now - begun) / (pace * self._expected[name])) if pace else 0.0
                done += self._expected[name] * max(by_time, self._shares.get(name, 0.0))
            elapsed = now - self._started
            return done / total, (total - done) * (elapsed + _PRIOR) / (done + _PRIOR)

    def _show(self) -> None:
        while not self._ended.wait(_INTERVALS[self._is_terminal]):
            if estimate := self.estimate():
                share, left = estimate
                if share < 1.0:
                    self._write(f"{100 * share:.0f} % done, about {_rounded(left)} s left", stays=False)
        if self._is_terminal:
            self._write("", stays=False)

    def _write(self, line: str, *, stays: bool) -> None:
        text = f"{self._name}: {line}" if line else ""
        if self._is_terminal:
            text = f"\r\x1b[K{text}"
        with self._lock:
            self._stream.write(f"{text}\n" if stays or not self._is_terminal else text)
            self._stream.flush()


def _rounded(seconds: float) -> int:
    """Return a time in whole seconds, above 20 s in steps of 5 s."""
    return 5 * round(seconds / 5) if seconds > 20 else max(1, round(seconds))
