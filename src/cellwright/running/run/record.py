"""Recording a run of a cell: what the recording says of itself, and what goes into it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import Effect
from cellwright.config.parsing.sources import Sources
from cellwright.engine.clock import nanoseconds
from cellwright.running.run.result import Collision, RunResult, versions

if TYPE_CHECKING:
    from cellwright.running.run.run import RunOptions


@dataclass(frozen=True)
class RecordOptions:
    """How a run is recorded.

    Attributes:
        paths: files to write: `.mcap`, or `.bag` for the tools of ROS 1.
        about: what the caller knows of the run besides, such as the agent's name.
        sources: the files that the trial was read from, so that the recording needs no other.
        files: those that were named, in their order.
        is_varied: whether the trial was varied by its seed after it was read.
        report: takes a line about a file that can be written no more.
    """

    paths: Sequence[Path]
    about: Mapping[str, Any] = field(default_factory=dict)
    sources: Sources | None = None
    files: Sequence[Path] = ()
    is_varied: bool = False
    report: Callable[[str], None] = lambda _line: None


class CellRecording:
    """A cell that is being recorded.

    Args:
        cell: the cell, about to run.
        options: how it is recorded.
        run: what the run was told besides.

    Raises:
        UsageError: a file cannot be opened.
    """

    def __init__(self, cell: Cell, options: RecordOptions, run: RunOptions) -> None:
        from cellwright.recording.format.files import (
            RecordingFiles,  # it loads a good deal, which a run without it spares
        )
        from cellwright.recording.format.format import RecordingHeader
        from cellwright.recording.format.recorder import Recorder
        from cellwright.recording.format.run_log import RunEvents
        from cellwright.viewer.services.cell_panel import CellPanel

        self._cell = cell
        self._files = RecordingFiles(options.paths, report=options.report)
        facts = cell_facts(cell, options, run)
        self.panel = CellPanel(cell, options.about)
        """Tells what goes into the recording of what a page shows."""
        self._events = RunEvents(lambda value: self._recorder.event(value), options.about)
        self._recorder = Recorder(
            cell,
            self._files.path,
            RecordingHeader("cell", cell.name, facts),
            attachments=_attachments(options, run),
            panel=self.panel.panel,
            report=options.report,
        )
        self._begin()
        self._recorder.on_begin = self._begin
        cell.competition.on_effect.append(self._keep)

    @property
    def is_whole(self) -> bool:
        """Whether everything is in the files that were asked for."""
        return self._recorder.is_whole and self._files.is_whole

    @property
    def files(self) -> list[Path]:
        """The files that were written."""
        return self._files.written

    def end(self, result: RunResult | None = None) -> None:
        """The run is over; without a result it was broken off. Again is no error."""
        if self._recorder.is_over:
            return
        self._cell.competition.on_effect.remove(self._keep)
        if result is None:
            self._recorder.end({"outcome": "broken off"})
        else:
            name = result.outcome.name.lower()
            more: dict[str, Any] = {"competition_state": result.competition_state, "state_hash": result.state_hash}
            more |= {"error": result.error, "simulated": result.simulated, "steps": result.steps}
            self._events.end(name, result.evidence, self._cell.simulation.now, more)
            self.panel.end({"outcome": name, "wall": result.wall, **more})
            self._recorder.end({"outcome": name, "score": result.score.total, "wall": result.wall, **more})
        self._files.finish(self._recorder.paths)

    def collision(self, collision: Collision) -> None:
        """Keep a collision of the arm."""
        self._events.collision(asdict(collision))

    def _begin(self) -> None:
        cell = self._cell
        about = {"seed": cell.seed, "servo": cell.servo, "timestep": float(cell.simulation.clock.timestep)}
        self._events.begin(cell.trial, about | {"versions": versions()})

    def _keep(self, effect: Effect) -> None:
        self._events.effect(effect, self._cell.simulation.now)


def cell_facts(cell: Cell, options: RecordOptions, run: RunOptions) -> dict[str, Any]:
    """What a run of a cell depends on besides what comes from outside, as JSON values."""
    timestep = cell.simulation.clock.timestep
    return {
        "versions": versions(),
        "recorded": datetime.now(UTC).isoformat(timespec="seconds"),
        **options.about,
        "seed": cell.seed,
        "servo": cell.servo,
        "competition": cell.in_competition,
        "timestep": [timestep.numerator, timestep.denominator],
        "circumstances": asdict(cell.trial.circumstances),
        "varied": options.is_varied,
        "checkpoints": sorted(nanoseconds(when) for when, _ in run.checkpoints),
        **source_facts(options),
    }


def source_facts(options: RecordOptions) -> dict[str, Any]:
    """Which of the files in a recording were named, in their order, and the folders of ROS packages among them."""
    sources = options.sources
    if sources is None:
        return {"files": [], "packages": []}
    return {"files": [sources.name(path) for path in options.files], "packages": sources.packages()}


def source_attachments(options: RecordOptions) -> dict[str, bytes]:
    """The files that were read, as they go into a recording."""
    from cellwright.recording.format.format import SOURCES

    files = {} if options.sources is None else options.sources.files()
    return {f"{SOURCES}{name}": content for name, content in files.items()}


def record_while(cell: Cell, options: RecordOptions, run: RunOptions, leaving: ExitStack) -> CellRecording:
    """Record a cell until its run is over, or broken off."""
    recording = CellRecording(cell, options, run)
    leaving.callback(recording.end)
    return recording


def _attachments(options: RecordOptions, run: RunOptions) -> dict[str, bytes]:
    from cellwright.recording.format.format import START

    found = source_attachments(options)
    if run.start is not None:
        found[START] = run.start.read_bytes()
    return found
