"""The engine's share of a run's time, measured within the run.

The engine could be timed alone afterwards, with the run's input. It would then find its data in the processor's cache,
which the rest of a step normally displaces. A machine that is slower for a moment would also affect only one of the
two. So each call of the engine is timed where it is made. The cost of the clock itself is measured as well, and
subtracted from both the engine's time and the run's.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

STEPPING = {"mj_step": 1, "mj_step1": 0, "mj_step2": 1}
"""The engine's functions that let time pass, and the number of steps that a call ends."""

CALLS = 100_000
"""Number of empty calls that measure the cost of the clock."""


class EngineTime:
    """Time of the engine, and of its timing.

    Args:
        within: share of the timing of a call that is measured with it [s].
        whole: time that the timing of a call adds to the run [s].

    Attributes:
        measured: between the two readings of the clock, over all calls [s].
        calls: number of timed calls.
        steps: number of the engine's steps in them.
    """

    def __init__(self, within: float = 0.0, whole: float = 0.0) -> None:
        self.measured = 0.0
        self.calls = 0
        self.steps = 0
        self._within = within
        self._whole = whole

    @property
    def spent(self) -> float:
        """The engine's own time [s]."""
        return self.measured - self.calls * self._within

    @property
    def overhead(self) -> float:
        """Time that the timing has added to the run [s]."""
        return self.calls * self._whole

    def timed(self, function: Callable[..., Any], steps: int) -> Callable[[Any, Any], None]:
        """Return a function of the engine that times each of its calls."""
        clock = time.perf_counter

        def call(model: Any, data: Any) -> None:
            begin = clock()
            function(model, data)
            self.measured += clock() - begin
            self.calls += 1
            self.steps += steps

        return call


@contextmanager
def engine_timed() -> Iterator[EngineTime]:
    """Time every step that the engine makes inside, in any simulation.

    A simulation that keeps the engine's functions must be built inside.
    """
    found = EngineTime(*cost_of_timing())
    kept = {name: getattr(mujoco, name) for name in STEPPING}
    for name, steps in STEPPING.items():
        setattr(mujoco, name, found.timed(kept[name], steps))
    try:
        yield found
    finally:
        for name, function in kept.items():
            setattr(mujoco, name, function)


def cost_of_timing() -> tuple[float, float]:
    """Return the cost of timing a call [s]: the share that is measured with it, and all of it."""
    probe = EngineTime()
    timed = probe.timed(nothing, 1)
    bare, whole = (_time_of(function) for function in (nothing, timed))
    return max(0.0, probe.measured / CALLS - bare), max(0.0, whole - bare)


def nothing(_model: object, _data: object) -> None:
    """Do nothing."""


def _time_of(function: Callable[[object, object], None]) -> float:
    begin = time.perf_counter()
    for _ in range(CALLS):
        function(None, None)
    return (time.perf_counter() - begin) / CALLS
