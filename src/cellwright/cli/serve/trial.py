"""Serving a trial from the command line: the cell, its server, its ROS 1 side, and what is said of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import parameters
from cellwright.cli import lines, options, recorded, videos
from cellwright.cli.bar import bar
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.run import document, score_table
from cellwright.cli.run.pictures import Pictures
from cellwright.cli.run.progress import RunProgress
from cellwright.cli.serve.result import offer_result
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.cli.view.arguments import PageWish
from cellwright.cli.view.page import page_on, show_the_end
from cellwright.config.trial.trial import Trial
from cellwright.engine.tempo import Tempo
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.server import Server
from cellwright.middleware.server.server import LOOPBACK
from cellwright.recording.format.run_log import RunLog
from cellwright.rendering.camera import Camera
from cellwright.rendering.video_wish import VideoWish
from cellwright.rendering.views import VIEWS
from cellwright.running.run import Outcome, RecordOptions, RunOptions, RunResult
from cellwright.running.serving import Hooks, Serving
from cellwright.viewer.services import onlookers
from cellwright.viewer.services.cell_panel import IN_COMPETITION, CellPanel
from cellwright.viewer.services.control import Control, Reset

EXIT_ON_COMPLETION = "ARIAC_EXIT_ON_COMPLETION"
"""Environment variable of the original: with any value the simulator ends when the competition does."""


@dataclass(frozen=True)
class ServeOptions:
    """What serving a trial may be told.

    Attributes:
        speed: simulated seconds a wall second; None: as fast as it goes.
        lockstep: let time pass only when a guest asks.
        servo: servos of the arm; None: as the trial says.
        seed: root of all chance; None: the trial's own.
        competition: refuse what a competition refuses.
        until: stop at this simulation time [s]; None: when somebody stops it.
        ends_when_done: stop when the competition is done.
        host: address to listen at.
        port: port to listen at, as `Server` takes it.
        ros1: be the simulator of ROS 1 programs too.
        as_json: print the result as JSON, and nothing else on stdout.
        log: file for what happens.
        files: those that the trial is read from, as they were named.
        record: how it is recorded; None for not at all.
        picture: file for a picture of the cell at the end; none when it is stopped before the competition is done.
        camera: where that is taken from.
        video: a video to be written; it is not waited for where time keeps to the wall clock.
        verbose: say also how time kept to the wall clock.
        page: a page on it; None for none.
        paused: let time stand until somebody on the page lets it pass.
    """

    speed: float | None = 1.0
    lockstep: bool = False
    servo: str | None = None
    seed: int | None = None
    competition: bool = True
    until: float | None = None
    ends_when_done: bool = False
    host: str = LOOPBACK
    port: int | None = None
    ros1: bool = False
    as_json: bool = False
    log: Path | None = None
    files: Sequence[str] = ()
    record: RecordOptions | None = None
    picture: Path | None = None
    camera: Camera = VIEWS["overview"]
    video: VideoWish | None = None
    verbose: bool = False
    page: PageWish | None = None
    paused: bool = False


def serve_trial(
    load: Callable[[], Trial], wanted: ServeOptions, on_cell: Callable[[Cell], None] = lambda _cell: None
) -> int:
    """Serve a trial until it is over or a signal ends it, and print what came of it.

    Args:
        load: gives the trial.
        wanted: how.
        on_cell: called with the cell before its time passes.

    Returns:
        The exit status.
    """
    console = Console(stderr=wanted.as_json, highlight=False)
    is_stopped = Stop()
    with stopped_by_signals(is_stopped.stop), ExitStack() as to_close:
        trial, record = recorded.with_sources(wanted.record, load, lambda _: options.paths(wanted.files))
        warn = partial(console.print, markup=False, soft_wrap=True, style="yellow")
        ros = to_close.enter_context(Ros1(warn, lambda: is_stopped.has_come)) if wanted.ros1 else None
        if ros is not None:
            ros.prepare()
        cell = Cell(
            trial,
            seed=wanted.seed,
            servo=options.servo(wanted.servo),
            competition=wanted.competition,
            report=warn,
        )
        on_cell(cell)
        say = partial(console.print, markup=False, soft_wrap=True)
        progress = RunProgress(console, cell, until=wanted.until)
        report = partial(progress.line, style="yellow")
        if ros is not None:
            ros.report = report
        server = Server(cell, host=wanted.host, port=wanted.port, lockstep=wanted.lockstep, report=report)
        if not server.is_local:
            lines.warn(f"{wanted.host}: anybody who reaches this machine can drive the cell")

        def tell_the_page(result: RunResult) -> None:
            if wanted.page is not None:
                show_the_end(server, panel, control, document.of_run(cell, "served", result, DONE, []))

        hooks = Hooks(
            on_ready=lambda: _begin(console, cell, server, wanted.speed, ros),
            on_poll=_nothing if ros is None else ros.poll,
            on_over=tell_the_page,
        )
        tempo = Tempo(wanted.speed, paused=wanted.paused)
        serving = Serving(cell, server, tempo=tempo, hooks=hooks)
        hindrance = IN_COMPETITION if cell.in_competition else ""
        control = Control(tempo, reset=Reset(serving.begin_anew, lambda: hindrance), lockstep=wanted.lockstep)
        panel = CellPanel(cell)
        onlookers.offer(server, cell, lambda _: panel.panel(), control)
        to_close.enter_context(page_on(server, wanted.page, f"{cell.name} · Cellwright", say))
        offer_result(serving)
        is_stopped.follow(serving.stop)
        kept = None if wanted.log is None else RunLog(wanted.log, about={"agent": "served"}, report=lines.warn)
        waits = wanted.lockstep or wanted.speed is None
        film = None if wanted.video is None else videos.of_cell(cell, wanted.video, waits=waits, warn=lines.warn)
        with progress.running():
            run = RunOptions(
                until=wanted.until,
                ends_when_done=wanted.ends_when_done,
                log=kept,
                record=record,
                at=videos.actions(film),
                panel=panel,
            )
            result = serving.run(run)
    made = [] if film is None else [film.finish()]
    status = NOT_DONE if result.outcome is Outcome.UNSTABLE else DONE
    if result.error:
        typer.echo(result.error, err=True, nl=False)
    pace = serving.pace
    if not wanted.as_json:
        score_table.show(console, result)
        if pace is not None and (wanted.verbose or pace.stood):
            lines.note(console, "pace", lines.pace_text(pace))
    pictures = Pictures(wanted.camera, [], lines.warn)
    # After the score, since it takes a while; not for somebody who wants it to end now, with the work undone.
    if wanted.picture is not None and (result.outcome is Outcome.DONE or not is_stopped.has_come):
        with bar(console, f"drawing {wanted.picture}", 1.0) as tell:
            pictures.take(wanted.picture, cell, tell)
    is_whole = (kept is None or kept.lines.is_whole) and (film is None or film.is_whole) and result.is_recorded
    if pictures.missed or not is_whole:
        status = NOT_DONE
    if wanted.as_json:
        about = document.of_run(cell, "served", result, status, pictures.written) | {"pace": document.of_pace(pace)}
        typer.echo(json.dumps(about | {"videos": made}, indent=2))
    else:
        lines.note_files(console, "video", map(videos.sentence, made))
        lines.note_files(console, "picture", pictures.written)
        lines.note_files(console, "recording", result.recordings)
    return status


def _begin(console: Console, cell: Cell, server: Server, speed: float | None, ros: Ros1 | None) -> None:
    """Have ROS know the cell, if it is to; then say that it is ready."""
    if ros is None:
        _ready(console, cell, server, speed)
    elif ros.join(server.address, parameters(cell.trial, competition=cell.in_competition), server.wait):
        _ready(console, cell, server, speed, f", ROS 1 at {ros.master.uri}")


def _ready(console: Console, cell: Cell, server: Server, speed: float | None, more: str = "") -> None:
    console.print(lines.ready(cell.trial.name, server, speed) + more, markup=False, soft_wrap=True)


def _nothing() -> None:
    pass
