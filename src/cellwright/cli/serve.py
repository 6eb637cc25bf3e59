"""Command `cellwright serve`: a cell for programs in other processes, and the service for its result."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import parameters
from cellwright.cli import arguments, options, output
from cellwright.cli.arguments import (
    END,
    LOOK,
    OUTPUT,
    REACH,
    WORK,
    Development,
    Files,
    Host,
    Log,
    OpenPage,
    PageOptions,
    Port,
    Record,
    Seed,
    Servo,
    Until,
    Vary,
    View,
    ViewHost,
    ViewPort,
    page_options,
    refuse_camera_name,
)
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.output import progress_bar
from cellwright.cli.page import page_for, show_end
from cellwright.cli.run import summary
from cellwright.cli.run.session import Pictures
from cellwright.cli.run.summary import RunProgress
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.config.trial.trial import Trial
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.server import Server
from cellwright.middleware.server.server import LOOPBACK
from cellwright.recording.format.run_log import RunLog
from cellwright.rendering.camera import VIEWS, Camera
from cellwright.rendering.video_options import VideoOptions
from cellwright.running.run import Outcome, RecordOptions, RunOptions, RunResult
from cellwright.running.serving import Hooks, Serving
from cellwright.viewer.services import scene
from cellwright.viewer.services.cell_panel import IN_COMPETITION, CellPanel, hides_ground_truth, known_evidence
from cellwright.viewer.services.control import Control, Reset

RESULT = "/cellwright/result"
"""A service of the server itself, not of the cell: JSON with the result as a document, and as text for people."""

_WIDTH = 80


def offer_result(serving: Serving) -> None:
    """Offer the result to guests. Of a competition that is not over they are told what they may know, and no more."""
    cell = serving.cell

    def answer(_request: dict[str, Any]) -> dict[str, Any]:
        result = replace(serving.result_by_now(), evidence=known_evidence(cell))
        text = io.StringIO()
        summary.show_result(Console(file=text, width=_WIDTH, highlight=False), result)
        told = summary.result_document(cell, "served", result, 0, [])
        if hides_ground_truth(cell):
            told |= {"seed": None, "circumstances": None}  # with them one could reckon with noise and friction
        return {"document": told, "text": text.getvalue()}

    serving.server.offer(RESULT, answer)


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
    video: VideoOptions | None = None
    verbose: bool = False
    page: PageOptions | None = None
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
        trial, record = arguments.read_with_sources(wanted.record, load, lambda _: options.paths(wanted.files))
        warn = partial(console.print, markup=False, soft_wrap=True, style="yellow")
        ros = to_close.enter_context(Ros1(warn, lambda: is_stopped.has_come)) if wanted.ros1 else None
        if ros is not None:
            ros.prepare()
        cell = Cell(
            trial, seed=wanted.seed, servo=options.servo(wanted.servo), competition=wanted.competition, report=warn
        )
        on_cell(cell)
        say = partial(console.print, markup=False, soft_wrap=True)
        progress = RunProgress(console, cell, until=wanted.until)
        report = partial(progress.line, style="yellow")
        if ros is not None:
            ros.report = report
        server = Server(cell, host=wanted.host, port=wanted.port, lockstep=wanted.lockstep, report=report)
        if not server.is_local:
            output.warn(f"{wanted.host}: anybody who reaches this machine can drive the cell")

        def tell_the_page(result: RunResult) -> None:
            if wanted.page is not None:
                show_end(server, panel, control, summary.result_document(cell, "served", result, DONE, []))

        hooks = Hooks(
            on_ready=lambda: _begin(console, cell, server, wanted.speed, ros),
            on_poll=_nothing if ros is None else ros.poll,
            on_over=tell_the_page,
        )
        tempo = RateControl(wanted.speed, paused=wanted.paused)
        serving = Serving(cell, server, tempo=tempo, hooks=hooks)
        hindrance = IN_COMPETITION if cell.in_competition else ""
        control = Control(tempo, reset=Reset(serving.begin_anew, lambda: hindrance), lockstep=wanted.lockstep)
        panel = CellPanel(cell)
        scene.offer_viewer_services(server, cell, lambda _: panel.panel(), control)
        to_close.enter_context(page_for(server, wanted.page, f"{cell.name} · Cellwright", say))
        offer_result(serving)
        is_stopped.follow(serving.stop)
        kept = None if wanted.log is None else RunLog(wanted.log, about={"agent": "served"}, report=output.warn)
        waits = wanted.lockstep or wanted.speed is None
        film = None if wanted.video is None else arguments.film_cell(cell, wanted.video, waits=waits, warn=output.warn)
        with progress.running():
            run = RunOptions(
                until=wanted.until,
                ends_when_done=wanted.ends_when_done,
                log=kept,
                record=record,
                at=arguments.video_actions(film),
                panel=panel,
            )
            result = serving.run(run)
    made = [] if film is None else [film.finish()]
    status = NOT_DONE if result.outcome is Outcome.UNSTABLE else DONE
    if result.error:
        typer.echo(result.error, err=True, nl=False)
    pace = serving.pace
    if not wanted.as_json:
        summary.show_result(console, result)
        if pace is not None and (wanted.verbose or pace.stood):
            output.note(console, "pace", output.pace_text(pace))
    pictures = Pictures(wanted.camera, [], output.warn)
    # After the score, since it takes a while; not for somebody who wants it to end now, with the work undone.
    if wanted.picture is not None and (result.outcome is Outcome.DONE or not is_stopped.has_come):
        with progress_bar(console, f"drawing {wanted.picture}", 1.0) as tell:
            pictures.take(wanted.picture, cell, tell)
    is_whole = (kept is None or kept.lines.is_whole) and (film is None or film.is_whole) and result.is_recorded
    if pictures.missed or not is_whole:
        status = NOT_DONE
    if wanted.as_json:
        about = summary.result_document(cell, "served", result, status, pictures.written) | {
            "pace": summary.pace_document(pace)
        }
        typer.echo(json.dumps(about | {"videos": made}, indent=2))
    else:
        output.note_files(console, "video", map(arguments.video_sentence, made))
        output.note_files(console, "picture", pictures.written)
        output.note_files(console, "recording", result.recordings)
    return status


def _begin(console: Console, cell: Cell, server: Server, speed: float | None, ros: Ros1 | None) -> None:
    """Have ROS know the cell, if it is to; then say that it is ready."""
    if ros is None:
        _ready(console, cell, server, speed)
    elif ros.join(server.address, parameters(cell.trial, competition=cell.in_competition), server.wait):
        _ready(console, cell, server, speed, f", ROS 1 at {ros.master.uri}")


def _ready(console: Console, cell: Cell, server: Server, speed: float | None, more: str = "") -> None:
    console.print(output.ready_line(cell.trial.name, server, speed) + more, markup=False, soft_wrap=True)


def _nothing() -> None:
    pass


def serve(
    files: Files,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="FACTOR",
            help=f"Simulated seconds a second, or `max`. Default: {options.SPEED}, else 1; in lockstep `max`.",
            rich_help_panel=WORK,
        ),
    ] = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", metavar="", help="Let time pass only when a guest asks.", rich_help_panel=WORK)
    ] = False,
    servo: Servo = None,
    seed: Seed = None,
    vary: Vary = False,
    development: Development = False,
    until: Until = None,
    exit_on_completion: Annotated[
        bool,
        typer.Option(
            "--exit-on-completion",
            metavar="",
            help=f"Stop when the competition is done; also with {EXIT_ON_COMPLETION} set.",
            rich_help_panel=END,
        ),
    ] = False,
    host: Host = LOOPBACK,
    port: Port = None,
    ros1: Annotated[
        bool,
        typer.Option(
            "--ros1",
            metavar="",
            help="Be the simulator of ROS 1 programs too, at the master that ROS_MASTER_URI names.",
            rich_help_panel=REACH,
        ),
    ] = False,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            metavar="",
            help="Print the result as JSON at the end, and nothing else on stdout.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    log: Log = None,
    record: Record = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.png",
            help="Write a picture of the cell at the end, unless it is stopped with the competition not done.",
            rich_help_panel=LOOK,
        ),
    ] = None,
    camera: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Where it is taken from: overview, bins, belt, agv1, agv2, or `x,y,z:x,y,z` [m].",
            rich_help_panel=LOOK,
        ),
    ] = "overview",
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    open_page: OpenPage = False,
    video: arguments.VideoFile = None,
    video_camera: arguments.VideoCamera = None,
    video_speed: arguments.VideoSpeed = 1.0,
    video_size: arguments.VideoSize = arguments.DEFAULT_VIDEO_SIZE,
    video_fine: arguments.VideoFine = False,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose", "-v", metavar="", help="Say also how time kept to the wall clock.", rich_help_panel=OUTPUT
        ),
    ] = False,
) -> None:
    """Run a trial for programs in other processes, until Ctrl-C; then print its score.

    Programs connect over a socket; what happens is a line each.

        # the lesson's cell, in real time
        cellwright serve lesson

        # the same, and a page to look at it
        cellwright serve lesson --view

        # time passes only when a program asks for it: the same result on any host
        cellwright serve lesson --lockstep

        # then, in another terminal: your program works that cell
        cellwright run --connect 127.0.0.1:11399 --agent my_robot.py:MyRobot

        # the same cell for programs of ROS 1, with a master if there is none
        cellwright serve lesson --ros1

    Exit status: 0 stopped, by whatever was asked for; 1 the simulation became unstable, or a file that was asked
    for is not whole; 2 bad input, and nothing was started.
    """
    refuse_camera_name(files, view=view)
    kept = arguments.record_options(record, agent="served")
    wanted = ServeOptions(
        files=files,
        record=None if kept is None else replace(kept, is_varied=vary),
        speed=_rate_of(speed, lockstep=lockstep),
        lockstep=lockstep,
        servo=servo,
        seed=options.seed(seed),
        competition=not development,
        until=options.until(until),
        ends_when_done=exit_on_completion or EXIT_ON_COMPLETION in os.environ,
        host=host,
        port=port,
        ros1=ros1,
        as_json=as_json,
        log=options.output_file("--log", log, ".jsonl"),
        picture=options.output_file("--picture", picture, ".png"),
        camera=options.camera(camera),
        video=arguments.video_options(video, video_camera, video_speed, video_size, fine=video_fine),
        verbose=verbose,
        page=page_options(view=view, host=view_host, port=view_port, opens=open_page),
    )
    raise typer.Exit(serve_trial(partial(options.trial, files, seed, is_varied=vary), wanted))


def _rate_of(text: str | None, *, lockstep: bool) -> float | None:
    if text is None and not lockstep:
        return options.default_speed(os.environ)
    return options.speed("max" if text is None else text)
