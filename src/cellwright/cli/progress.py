"""What somebody sees while a cell runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

from cellwright.cell import Cell
from cellwright.kitting.effects import (
    Effect,
    KitSubmitted,
    OrderAnnounced,
    OrderCompleted,
    StateChanged,
    TrialEnded,
)

_REDRAW = 0.1


class RunProgress:
    """A line that moves while a cell runs, and a line that stays for each thing that the referee does."""

    def __init__(self, console: Console, cell: Cell, until: float | None) -> None:
        limit = until if until is not None else cell.trial.time_limit
        self._total = limit if limit >= 0 else None
        self._console = console
        self._cell = cell
        self._progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            TextColumn("{task.fields[status]}"),
            console=console,
            transient=True,
        )
        self._task = self._progress.add_task("simulating", total=self._total, status="")
        self._begin = time.perf_counter()
        self._drawn = 0.0
        cell.competition.on_effect.append(self._tell)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self._progress.stop()

    def update(self, cell: Cell) -> None:
        """Show how far the cell is, not more than ten times a second."""
        now = time.perf_counter()
        if now - self._drawn < _REDRAW:
            return
        self._drawn = now
        factor = cell.simulation.time / (now - self._begin)
        status = f"{cell.simulation.time:7.1f} s  {factor:5.1f} x real time  {cell.competition.state}"
        self._progress.update(self._task, completed=cell.simulation.time if self._total else None, status=status)

    @contextmanager
    def task(self, description: str) -> Iterator[Callable[[float], None]]:
        """A second line for something that takes a while; yields what tells the share that is done."""
        task = self._progress.add_task(description, total=1.0, status="")
        yield lambda done: self._progress.update(task, completed=done)
        self._progress.remove_task(task)

    def _tell(self, effect: Effect) -> None:
        text = sentence(effect)
        if text:
            self._console.print(f"{self._cell.simulation.time:9.3f} s  {text}", markup=False, soft_wrap=True)


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
