"""Checkpoints on disk at declared times.

Saving touches the run (see `snapshot.py`), so the times at which it happens are part of the run's state: a run with
the same checkpoints has the same state hash, whether its files were kept, lost or never written.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from cellwright.engine.device import Device, State
from cellwright.engine.snapshot import renew_engine, write_checkpoint

_LAST = 1_000_000
"""Priority among a tick's events: everything else has happened."""


class Checkpoints(Device):
    """Saves the simulation at the times that were declared before the run.

    Args:
        report: takes a line about a file that could not be written; the run goes on.
    """

    def __init__(self, report: Callable[[str], None] = lambda _line: None) -> None:
        super().__init__("checkpoints")
        self._report = report
        self.missed: list[Path] = []
        """The files that could not be written, in all runs so far."""
        self._paths: dict[int, Path | None] = {}
        self._times: list[int] = []

    def declare(self, time: int, path: Path | None) -> None:
        """Save at `time` [ns] to `path` in every run that begins from now on; None does all but write."""
        self._paths[time] = path

    def withdraw(self, time: int) -> None:
        """Save at `time` [ns] no more, in runs that begin from now on."""
        self._paths.pop(time, None)

    def reset(self) -> None:
        """Wait for the declared times."""
        self._times = sorted(self._paths)
        for time in self._times:
            self.simulation.schedule(self, "save", time, at=time, priority=_LAST)

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Save."""
        if kind != "save":
            super().handle(kind, arguments)
        path = self._paths.get(arguments[0])
        if path is None:
            renew_engine(self.simulation)
            return
        try:
            write_checkpoint(self.simulation, path)
        except OSError as error:
            self.missed.append(path)
            self._report(f"checkpoint {path}: cannot be written: {error.strerror or error}")
            renew_engine(self.simulation)

    def get_state(self) -> dict[str, Any]:
        """The declared times."""
        return {"times": list(self._times)}

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned."""
        self._times = list(state["times"])
