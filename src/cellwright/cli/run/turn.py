"""What `cellwright run` does when the cell is there: it is worked, and what came of it is told."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.score.scorer import GameScore
from cellwright.cell.kitting.score.trial_score import Averages, TrialScore, trial_score
from cellwright.cli import exit_status, lines, recorded, videos
from cellwright.cli.bar import bar
from cellwright.cli.run import document, score_table
from cellwright.cli.run.pictures import Pictures, Quality
from cellwright.cli.run.progress import RunProgress
from cellwright.cli.signals import ended_as_by_ctrl_c
from cellwright.clients.agents.agent import Agent
from cellwright.config.trial.trial import Trial
from cellwright.recording.format.run_log import RunLog
from cellwright.rendering.camera import Camera
from cellwright.rendering.video_wish import VideoWish
from cellwright.running.run import Outcome, RecordOptions, RunOptions, RunResult, run_cell
from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from cellwright.cli.run.attended import Attended
    from cellwright.viewer.filming import Filming, Made


@dataclass
class Turn:
    """A cell that is worked once, or again when somebody who looks on has it begin anew.

    Attributes:
        cell: the cell.
        agent: name of what works it.
        make: makes that; None for nobody.
        worker: the first that was made, for an agent in this process.
        options: what the run is told besides.
        console: where people read.
        way: how an agent in a process of its own comes to the cell; None for one in this process.
        lockstep: with a way: whether time passes only while the agent waits.
        verbose: say what the agent logs.
        camera: where pictures are taken from.
        quality: how pictures are drawn.
        snapshots: times [s] and files of pictures.
        picture: write one at the end.
        video: a video to be written; one of a run that begins anew has a file of its own.
        log: file for what happens.
        record: how it is recorded; None for not at all.
        least: score that is to be reached.
        spent: averages of all teams, for the score of the trial as in the finals.
        as_json: print the result as JSON, and nothing else on stdout.
        attended: who looks on; None for nobody.
    """

    cell: Cell
    agent: str
    make: Callable[[], Agent] | None
    worker: Agent | None
    options: RunOptions
    console: Console
    way: str | None
    lockstep: bool
    verbose: bool
    camera: Camera
    quality: Quality
    snapshots: Sequence[tuple[Fraction, Path]]
    picture: bool
    video: VideoWish | None
    log: Path | None
    record: RecordOptions | None
    least: float | None
    spent: Averages | None
    as_json: bool
    attended: Attended | None = None
    is_interrupted: bool = False
    """Whether somebody has ended the newest run by Ctrl-C."""

    def __post_init__(self) -> None:
        self._played = 0
        self._progress = RunProgress(self.console, self.cell, until=self.options.until, verbose=self.verbose)

    def play(self) -> int:
        """Have the cell worked from start to end, and tell what came of it; the exit status."""
        self._played += 1
        pictures = Pictures(self.camera, self.snapshots, lines.warn, self.quality)
        log = None if self.log is None else videos.numbered(self.log, self._played)
        kept = None if log is None else RunLog(log, about={"agent": self.agent}, report=lines.warn)
        film = self._film()
        actions = [*videos.actions(film), *pictures.actions()]
        wanted = replace(self.options, at=actions, on_progress=self._progress.update, log=kept)
        wanted = replace(wanted, record=recorded.of_turn(self.record, self._played))
        with redirect_stdout(sys.stderr) if self.as_json else nullcontext():  # what an agent prints is no JSON
            worker, self.worker = self.worker, None
            if worker is None and self.make is not None and self.way is None:
                worker = self.make()
            with self._progress.running(), ended_as_by_ctrl_c():
                result = self._run(worker, wanted)
        made = [] if film is None else [film.finish()]
        self.is_interrupted = result.outcome is Outcome.INTERRUPTED
        if self.attended is not None and self.attended.begins_anew:
            self.console.print("the run begins anew")
            return exit_status.NOT_DONE
        pictures.finish(self.cell.simulation.time)
        status = exit_status.of_run(result, has_agent=self.make is not None, min_score=self.least)
        is_whole = (kept is None or kept.lines.is_whole) and (film is None or film.is_whole) and result.is_recorded
        if pictures.missed or self.cell.checkpoints.missed or not is_whole:
            status = status or exit_status.NOT_DONE  # what was asked for is not all there
        self._tell(result, pictures, made, status)
        return status

    def _film(self) -> Filming | None:
        if self.video is None:
            return None
        wish = replace(self.video, file=videos.numbered(self.video.file, self._played))
        return videos.of_cell(self.cell, wish, waits=self.options.speed is None, warn=lines.warn)

    def _run(self, worker: Agent | None, wanted: RunOptions) -> RunResult:
        if self.make is not None and self.way is not None:
            from cellwright.cli.run.hosted import hosted

            report = partial(self._progress.line, style="yellow")
            return hosted(
                self.cell,
                self.agent,
                wanted if self.attended is None else replace(wanted, panel=self.attended.panel),
                way=self.way,
                lockstep=self.lockstep,
                verbose=self.verbose,
                report=report,
                attended=self.attended,
            )
        return run_cell(self.cell, worker, wanted) if self.attended is None else self.attended.run(worker, wanted)

    def _tell(self, result: RunResult, pictures: Pictures, made: list[Made], status: int) -> None:
        cell, console = self.cell, self.console
        final = None if self.spent is None else finals_score(cell.trial, result.score, self.spent)
        if result.error:
            sys.stderr.write(result.error)
        about: Callable[[], dict[str, Any]] = lambda: document.of_run(  # noqa: E731
            cell, self.agent, result, status, pictures.written, final
        )
        if self.attended is not None:
            self.attended.tell(about())
        if not self.as_json:
            score_table.show(console, result, final)
            if self.least is not None and result.score.total < self.least:
                lines.note(console, "not enough", f"{self.least:g} points were asked for")
        if self.picture and not self.is_interrupted:
            file = Path(f"{cell.trial.name}.png")
            with bar(console, f"drawing {file}", 1.0) as tell:
                pictures.take(file, cell, tell)
        if self.as_json:
            typer.echo(json.dumps(about() | {"videos": made}, indent=2))
        else:
            lines.note_files(console, "video", map(videos.sentence, made))
            lines.note_files(console, "picture", pictures.written)
            lines.note_files(console, "recording", result.recordings)


def finals_score(trial: Trial, score: GameScore, spent: Averages) -> TrialScore | None:
    """The score of the trial; without one, such as after points in no time, the run still has its result."""
    try:
        return trial_score(trial.sensors, score.orders, spent)
    except UsageError as error:
        lines.warn(f"the trial has no score: {error}")
        return None
