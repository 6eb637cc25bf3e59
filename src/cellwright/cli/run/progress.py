"""What somebody sees while a cell runs: on a terminal a line that moves, elsewhere a plain line now and then."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import (
    Effect,
    KitSubmitted,
    OrderAnnounced,
    OrderCompleted,
    StateChanged,
    TrialEnded,
)
from cellwright.cli.bar import Tell, bar

_REDRAW = 0.1  # [s] of wall time
_PLAIN_LINE = 2.0  # [s] of wall time between plain lines, for logs that are read afterwards


class RunProgress:
    """Tells on a console how a run goes.

    Each thing that the referee does is a line that stays, with its simulation time, and so is each line that is logged.

    Args:
        console: where to.
        cell: what runs.
        until: the simulation time [s] at which the run is to stop, if any.
        verbose: whether to tell what is logged at level INFO, as agents do.
        clock: wall time [s]; to be replaced in tests.
    """

    def __init__(
        self,
        console: Console,
        cell: Cell,
        *,
        until: float | None = None,
        verbose: bool = False,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        limit = until if until is not None else cell.trial.time_limit
        self._total = limit if limit > 0 else None
        self._console = console
        self._cell = cell
        self._level = logging.INFO if verbose else logging.WARNING
        self._clock = clock
        self._shown = clock()
        self._since: tuple[float, float] | None = None  # wall time and simulation time at the first look
        self._bar: Tell | None = None
        cell.competition.on_effect.append(self._tell)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Tell of what happens inside."""
        log, handler = logging.getLogger(), _LogLines(self.line)
        level = log.level
        log.addHandler(handler)
        log.setLevel(self._level)
        self._shown = self._clock()
        try:
            with bar(self._console, "simulating", self._total) as self._bar:
                yield
        finally:
            self._bar = None
            log.removeHandler(handler)
            log.setLevel(level)

    def update(self, cell: Cell) -> None:
        """Show how far the cell is, unless that was shown a moment ago."""
        now = self._clock()
        simulated = cell.simulation.time
        if self._since is None:
            self._since = now, simulated
            self._shown = now
            return
        if now - self._shown < (_REDRAW if self._bar else _PLAIN_LINE):
            return
        self._shown = now
        factor = f"{(simulated - self._since[1]) / (now - self._since[0]):.1f} x real time"
        state = cell.competition.state
        if self._bar is None:
            self.line(f"{factor}, {state}")
        else:
            self._bar(simulated if self._total else None, f"{simulated:.1f} s  {factor}  {state}")

    def line(self, text: str, style: str | None = None) -> None:
        """A line that stays, with the simulation time."""
        self._console.print(f"{self._cell.simulation.time:9.3f} s  {text}", markup=False, soft_wrap=True, style=style)

    def _tell(self, effect: Effect) -> None:
        text = sentence(effect)
        if text:
            self.line(text)


class _LogLines(logging.Handler):
    """Passes on what is logged, a line at a time."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__()
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        for line in self.format(record).splitlines():
            self._say(line)


def sentence(effect: Effect) -> str:
    """What the referee did, in one sentence; empty for what goes without saying."""
    match effect:
        case StateChanged(state):
            return f"competition: {state}"
        case OrderAnnounced(order, reason, interrupts):
            kits = ", ".join(kit.kit_type for kit in order.kits)
            tail = f"; {interrupts} waits" if interrupts else ""
            return f"announcing {order.order_id} ({reason}): {kits}{tail}"
        case KitSubmitted(tray, kit_type, score, repeated):
            name = tray.rpartition("::")[0].rpartition("::")[2]
            if score.refusal is not None:
                return f"{name} submitted as {kit_type}: {score.refusal.sentence()}"
            again = " (submitted before: the first score counts)" if repeated else ""
            return f"{name} submitted as {kit_type}: {score.total:g} of {score.maximum:g} points{again}"
        case OrderCompleted(score, resumes):
            tail = f"; {resumes} goes on" if resumes else ""
            return f"{score.order_id} is complete: {score.total:g} points in {score.time_taken / 1e9:.1f} s{tail}"
        case TrialEnded(reason, score, _):
            return f"the trial is over ({reason}): {score.total:g} points"
        case _:
            return ""
