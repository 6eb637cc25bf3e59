"""What a run may be told besides its cell and its agent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from cellwright.cell.cell import Cell
from cellwright.recording.format.run_log import RunLog
from cellwright.running.run.record import RecordOptions

if TYPE_CHECKING:
    from cellwright.viewer.services.cell_panel import CellPanel


@dataclass(frozen=True)
class RunOptions:
    """What a run may be told besides its cell and its agent.

    Attributes:
        speed: simulated seconds a wall second; None: as fast as it goes.
        until: stop at this simulation time [s]; None: when the run is over.
        ends_when_done: whether the run is over soon after the competition is; else it goes on.
        listen: topics to listen to besides; "all" stands for every topic.
        at: actions at given simulation times [s], such as taking a picture.
        on_progress: called ten times a simulated second.
        checkpoints: files to save the simulation to, at given simulation times [s]; the times are part of the run.
        log: takes what happens, to keep it on disk as it grows.
        record: how the run is recorded, if it is.
        panel: shows the run; it gets the collisions of the arm.
        start: a checkpoint to begin from, instead of time 0. The agent begins anew all the same.
    """

    speed: float | None = None
    until: float | None = None
    ends_when_done: bool = True
    listen: Sequence[str] = ()
    at: Sequence[tuple[Fraction, Callable[[Cell], None]]] = ()
    on_progress: Callable[[Cell], None] | None = None
    checkpoints: Sequence[tuple[Fraction, Path]] = ()
    start: Path | None = None
    panel: CellPanel | None = None
    log: RunLog | None = None
    record: RecordOptions | None = None
