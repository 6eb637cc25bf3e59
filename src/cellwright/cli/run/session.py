"""Run of `cellwright run`: one cell worked from start to end, its pictures, and the report on it."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout
from dataclasses import dataclass, replace
from enum import StrEnum
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.scorer import Averages, GameScore, TrialScore, trial_score
from cellwright.cli import arguments, main, output
from cellwright.cli.output import progress_bar
from cellwright.cli.run import summary
from cellwright.cli.run.summary import RunProgress
from cellwright.cli.signals import ended_as_by_ctrl_c
from cellwright.clients.agents.agent import Agent
from cellwright.config.trial.trial import Trial
from cellwright.recording.format.run_log import RunLog
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import Progress, render, save_png
from cellwright.rendering.scene.engine import SceneTaker
from cellwright.rendering.video_options import HEIGHT, WIDTH, VideoOptions
from cellwright.running.run import Outcome, RecordOptions, RunOptions, RunResult, run_cell
from cellwright.util.errors import RenderingError, UsageError

if TYPE_CHECKING:
    from cellwright.cli.page import ViewedRun
    from cellwright.viewer.filming import Filming, Made


class Quality(StrEnum):
    """How pictures are drawn."""

    FINE = "fine"
    """By rays, with soft shadows from many lamps: some seconds each."""
    FAST = "fast"
    """As a video is, by OpenGL: a second each, most of it for its start."""


class Pictures:
    """Takes pictures of one run, and knows which were taken.

    Args:
        camera: where they are taken from.
        wanted: simulation times [s] and files.
        say: takes a line about a picture that could not be written or was never taken.
        quality: how they are drawn.
    """

    def __init__(
        self,
        camera: Camera,
        wanted: Sequence[tuple[Fraction, Path]],
        say: Callable[[str], None],
        quality: Quality = Quality.FINE,
    ) -> None:
        self._quality = quality
        self._camera = camera
        self._wanted = wanted
        self._say = say
        self.written: list[str] = []
        """The files that were written, in order."""
        self.missed: list[str] = []
        """The files that were asked for and not written."""

    def actions(self) -> list[tuple[Fraction, Callable[[Cell], None]]]:
        """What a run is to do at which time [s]."""
        return [(when, self._action(file)) for when, file in self._wanted]

    def finish(self, simulated: float) -> None:
        """Say which pictures were never taken, for the run ended before, at `simulated` [s]."""
        for when, file in self._wanted:
            if str(file) not in (*self.written, *self.missed):
                self._miss(file, f"{file} was not taken: the run ended at {simulated:g} s, before {float(when):g} s")

    def take(self, file: Path, cell: Cell, progress: Progress | None = None) -> None:
        """Take a picture now."""
        try:
            if self._quality is Quality.FAST:
                _save_opengl_picture(file, cell, self._camera)
            else:
                save_png(file, render(*cell.seen, self._camera, progress=progress))
        # the disk is full, the folder is gone: the run is worth more than its picture
        except (UsageError, RenderingError) as error:
            self._miss(file, str(error))
        else:
            self.written.append(str(file))

    def _action(self, file: Path) -> Callable[[Cell], None]:
        def take(cell: Cell) -> None:
            self.take(file, cell)

        return take

    def _miss(self, file: Path, reason: str) -> None:
        self.missed.append(str(file))
        self._say(reason)


def _save_opengl_picture(file: Path, cell: Cell, camera: Camera) -> None:
    from cellwright.rendering.worker import RenderWorker  # it takes a moment to load

    cell.simulation.refresh()
    taker = SceneTaker(cell.simulation.model, name=cell.name, hidden=cell.out_of_sight)
    frame = taker.frame(cell.simulation.data, cell.simulation.now)
    with RenderWorker(taker.scene) as worker:
        picture = worker.colour(frame, camera, WIDTH, HEIGHT, samples=4).result()
    save_png(file, picture)


@dataclass
class RunSession:
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
    video: VideoOptions | None
    log: Path | None
    record: RecordOptions | None
    least: float | None
    spent: Averages | None
    as_json: bool
    attended: ViewedRun | None = None
    is_interrupted: bool = False
    """Whether somebody has ended the newest run by Ctrl-C."""

    def __post_init__(self) -> None:
        self._played = 0
        self._progress = RunProgress(self.console, self.cell, until=self.options.until, verbose=self.verbose)

    def play(self) -> int:
        """Have the cell worked from start to end, and tell what came of it; the exit status."""
        self._played += 1
        pictures = Pictures(self.camera, self.snapshots, output.warn, self.quality)
        log = None if self.log is None else arguments.numbered_file(self.log, self._played)
        kept = None if log is None else RunLog(log, about={"agent": self.agent}, report=output.warn)
        film = self._film()
        actions = [*arguments.video_actions(film), *pictures.actions()]
        wanted = replace(self.options, at=actions, on_progress=self._progress.update, log=kept)
        wanted = replace(wanted, record=arguments.numbered_recording(self.record, self._played))
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
            return main.NOT_DONE
        pictures.finish(self.cell.simulation.time)
        status = main.exit_status_of(result, has_agent=self.make is not None, min_score=self.least)
        is_whole = (kept is None or kept.lines.is_whole) and (film is None or film.is_whole) and result.is_recorded
        if pictures.missed or self.cell.checkpoints.missed or not is_whole:
            status = status or main.NOT_DONE  # what was asked for is not all there
        self._tell(result, pictures, made, status)
        return status

    def _film(self) -> Filming | None:
        if self.video is None:
            return None
        wish = replace(self.video, file=arguments.numbered_file(self.video.file, self._played))
        return arguments.film_cell(self.cell, wish, waits=self.options.speed is None, warn=output.warn)

    def _run(self, worker: Agent | None, wanted: RunOptions) -> RunResult:
        if self.make is not None and self.way is not None:
            from cellwright.cli.run.remote import run_hosted

            report = partial(self._progress.line, style="yellow")
            return run_hosted(
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
        about: Callable[[], dict[str, Any]] = lambda: summary.result_document(  # noqa: E731
            cell, self.agent, result, status, pictures.written, final
        )
        if self.attended is not None:
            self.attended.tell(about())
        if not self.as_json:
            summary.show_result(console, result, final)
            if self.least is not None and result.score.total < self.least:
                output.note(console, "not enough", f"{self.least:g} points were asked for")
        if self.picture and not self.is_interrupted:
            file = Path(f"{cell.trial.name}.png")
            with progress_bar(console, f"drawing {file}", 1.0) as tell:
                pictures.take(file, cell, tell)
        if self.as_json:
            typer.echo(json.dumps(about() | {"videos": made}, indent=2))
        else:
            output.note_files(console, "video", map(arguments.video_sentence, made))
            output.note_files(console, "picture", pictures.written)
            output.note_files(console, "recording", result.recordings)


def finals_score(trial: Trial, score: GameScore, spent: Averages) -> TrialScore | None:
    """The score of the trial; without one, such as after points in no time, the run still has its result."""
    try:
        return trial_score(trial.sensors, score.orders, spent)
    except UsageError as error:
        output.warn(f"the trial has no score: {error}")
        return None
