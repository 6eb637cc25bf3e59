"""Files of a run, written as it goes: video, log of events, and recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellwright.config.parsing.sources import sources_collected
from cellwright.rendering.video_options import VideoOptions
from cellwright.running.run.options import RecordOptions
from cellwright.running.run.result import SessionResult, cell_result
from cellwright.running.run.target import Filmable, Origin, Recordable, Refereed, RunControls, Target
from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from cellwright.recording.format.recorder import Recorder
    from cellwright.recording.format.run_log import RunLog

_NO_LOG = "log: only a cell has a log of events; leave it out for a robot or a recording"
_NO_RECORDING = "record: a recording cannot be recorded again; copy its file"
_NO_VIDEO = "video: a session cannot film a recording; use `cellwright replay FILE --video OUT.mp4`"


@dataclass
class RunFiles:
    """Files of one run. They are whole when the run is over, and end early when it is broken off.

    Attributes:
        target: target of the session.
        options: files that are requested.
        origin: files that the target was made from.
        number: number of the run, from 1; from 2 on it is part of the names.
        start: the checkpoint from which the run starts, if any.
        report: receives a line about a file that can no longer be written.
        result: result of the run, once it is over; each file adds what was written.
    """

    target: Target
    options: RecordOptions
    origin: Origin
    number: int
    start: Path | None
    report: Callable[[str], None]
    result: SessionResult | None = None
    _open_log: RunLog | None = None

    def refuse(self) -> None:
        """Raise UsageError for a file that the target cannot have; a log is refused when its run starts."""
        if self.options.paths and not isinstance(self.target, Recordable):
            raise UsageError(_NO_RECORDING)
        if self.options.video is not None and not isinstance(self.target, Filmable):
            raise UsageError(_NO_VIDEO)

    def open(self, run: ExitStack, *, waits: bool, latest_end: int | None, notice: Callable[[str], None]) -> None:
        """Open the files until `run` is left.

        Args:
            run: closes them.
            waits: simulation time waits for the video; else it follows the wall clock.
            latest_end: simulation time [ns] at which the run ends at the latest; None if it has no end.
            notice: receives lines about the progress of the video.

        Raises:
            RenderingError: the video cannot be written.
            UsageError: a file cannot be opened, or the target has no log.
        """
        if self.options.video is not None:
            run.enter_context(self._video(self.options.video, waits=waits, latest_end=latest_end, notice=notice))
        if self.options.log is not None:
            run.enter_context(self._log())
        if self.options.paths:
            run.enter_context(self._recording())

    def reset(self, before: int) -> None:
        """Write to the log that the run has started again at the time `before` [ns]."""
        if self._open_log is not None:
            self._open_log.reset(before)

    def _numbered(self, file: Path) -> Path:
        """Return the file of this name for the run: run.mp4, run_2.mp4."""
        return file if self.number == 1 else file.with_stem(f"{file.stem}_{self.number}")

    def _add(self, *, is_whole: bool, **written: Any) -> None:
        assert self.result is not None
        self.result = replace(self.result, is_complete=self.result.is_complete and is_whole, **written)

    @contextmanager
    def _video(
        self, options: VideoOptions, *, waits: bool, latest_end: int | None, notice: Callable[[str], None]
    ) -> Iterator[None]:
        assert isinstance(self.target, Filmable)
        film = self.target.film(replace(options, file=self._numbered(options.file)), waits=waits, report=self.report)
        film.expect(latest_end, notice)
        film.start()
        try:
            yield
        finally:
            made = film.finish()
        self._add(is_whole=film.is_whole, videos=(made,))

    @contextmanager
    def _log(self) -> Iterator[None]:
        from cellwright.recording.format.run_log import RunLog  # slow to load, as all of recording and filming

        referee, log = self.target, self.options.log
        if not isinstance(referee, Refereed) or log is None:
            raise UsageError(_NO_LOG)
        if isinstance(log, Path):
            log = RunLog(self._numbered(log), about=self.options.about, report=self.report)
        simulation = self.target.node.simulation
        self._open_log = log
        with referee.events(log, {"time": simulation.time}):
            yield
            result = cell_result(self.result)
            facts = result.facts(
                "competition_state", "state_hash", "error", "simulated", "wall", "steps", *result.of_task
            )
            log.end(result.word, result.evidence, simulation.now, facts)
            log.lines.close()
        self._add(is_whole=log.lines.is_whole)

    @contextmanager
    def _recording(self) -> Iterator[None]:
        from cellwright.recording.format.files import RecordingFiles
        from cellwright.recording.format.format import SOURCES, START
        from cellwright.recording.format.recorder import Recorder

        recordable, about = self.target, self.options.about
        assert isinstance(recordable, Recordable)
        files = RecordingFiles(list(map(self._numbered, self.options.paths)), report=self.report)
        sources = {} if self.origin.sources is None else self.origin.sources.files()
        attachments = {f"{SOURCES}{name}": content for name, content in sources.items()}
        if self.start is not None:
            attachments[START] = self.start.read_bytes()
        header = partial(recordable.header, about, self.origin)
        recorder = Recorder(
            self.target.node,
            files.path,
            header(),
            attachments=attachments,
            panel=lambda: recordable.recorded_panel(about),
            stamp=recordable.stamp(),
            report=self.report,
        )
        recorder.renew_header = header
        end: Mapping[str, Any] = {"outcome": "broken off"}
        try:
            with self._recorded_events(recorder, about):
                yield
            assert self.result is not None
            end = self.result.recorded()
        finally:
            recorder.end(end)
            files.finish(recorder.paths)
        is_whole = recorder.is_whole and files.is_whole
        self._add(is_whole=is_whole, recordings=tuple(files.written), is_recorded=is_whole)

    @contextmanager
    def _recorded_events(self, recorder: Recorder, about: Mapping[str, Any]) -> Iterator[None]:
        """Record the referee's actions, and collisions."""
        from cellwright.recording.format.run_log import RunEvents

        referee = self.target
        if not isinstance(referee, Refereed):
            yield
            return
        events = RunEvents(recorder.event, about)
        with referee.events(events, {}) as begin:
            recorder.on_begin = begin
            yield
            result = cell_result(self.result)
            facts = result.facts("competition_state", "state_hash", "error", "simulated", "steps", *result.of_task)
            events.end(result.word, result.evidence, self.target.node.simulation.now, facts)


def opened_origin(target: Target, controls: RunControls, *, is_recorded: bool) -> Origin:
    """Open a target; return the files that it was made from, which are collected if it is to be recorded."""
    if not (is_recorded and isinstance(target, Recordable)):
        target.open(controls)
        return Origin()
    with sources_collected() as sources:
        target.open(controls)
        return target.origin(sources)
