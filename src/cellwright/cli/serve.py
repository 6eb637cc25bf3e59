"""`cellwright serve`: a cell for programs in other processes."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright import variation
from cellwright.cell import Cell
from cellwright.cli import document, options, score_table
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.pictures import Pictures
from cellwright.cli.progress import RunProgress
from cellwright.cli.served_result import offer_result
from cellwright.cli.signals import stopped_by_signals
from cellwright.contracts.gear_parameters import parameters
from cellwright.description.trial import Trial
from cellwright.recording.run_log import RunLog
from cellwright.ros1_host import Ros1
from cellwright.run import Outcome, RunOptions
from cellwright.server import DEFAULT_PORT, Server
from cellwright.server.server import LOOPBACK
from cellwright.serving import Hooks, Pace, Serving
from cellwright.viewer.camera import Camera
from cellwright.viewer.views import VIEWS

_WORK, _END, _REACH, _OUTPUT = "What runs", "When it ends", "Where it is reached", "Output"

EXIT_ON_COMPLETION = "ARIAC_EXIT_ON_COMPLETION"
"""Environment variable of the original: with any value the simulator ends when the competition does."""


def serve(
    files: options.Files,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="FACTOR",
            help="Simulated seconds a second, or `max`; 1 when left out, and `max` in lockstep.",
            rich_help_panel=_WORK,
        ),
    ] = None,
    lockstep: Annotated[
        bool,
        typer.Option("--lockstep", metavar="", help="Let time pass only when a guest asks.", rich_help_panel=_WORK),
    ] = False,
    servo: Annotated[
        str | None,
        typer.Option(
            metavar="PROFILE",
            help="Servos of the arm: `original` (soft, as in 2017) or `precise`; as the file says when left out.",
            rich_help_panel=_WORK,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", help="Root of all chance; the file's own, else 0.", rich_help_panel=_WORK),
    ] = None,
    vary: Annotated[
        bool,
        typer.Option(
            "--vary",
            metavar="",
            help="Move parts in bins, change friction and the phases of belt and gripper a little, by the seed.",
            rich_help_panel=_WORK,
        ),
    ] = False,
    development: Annotated[
        bool,
        typer.Option(
            "--development-mode",
            "-d",
            metavar="",
            help="Allow what a competition refuses, such as setting the belt's power.",
            rich_help_panel=_WORK,
        ),
    ] = False,
    until: Annotated[
        float | None, typer.Option(metavar="T", help="Stop at this simulation time [s].", rich_help_panel=_END)
    ] = None,
    exit_on_completion: Annotated[
        bool,
        typer.Option(
            "--exit-on-completion",
            metavar="",
            help=f"Stop when the competition is done; also with {EXIT_ON_COMPLETION} set.",
            rich_help_panel=_END,
        ),
    ] = False,
    host: Annotated[str, typer.Option(metavar="HOST", help="Address to listen at.", rich_help_panel=_REACH)] = LOOPBACK,
    port: Annotated[
        int, typer.Option(metavar="N", help="Port to listen at; 0 takes a free one.", rich_help_panel=_REACH)
    ] = DEFAULT_PORT,
    ros1: Annotated[
        bool,
        typer.Option(
            "--ros1",
            metavar="",
            help="Be the simulator of ROS 1 programs too, at the master that ROS_MASTER_URI names.",
            rich_help_panel=_REACH,
        ),
    ] = False,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            metavar="",
            help="Print the result as JSON at the end, and nothing else on stdout.",
            rich_help_panel=_OUTPUT,
        ),
    ] = False,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.jsonl",
            help="Write what happens to this file as it happens, with the evidence of each kit; a line of JSON each.",
            rich_help_panel=_OUTPUT,
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Write a picture of the cell at the end.", rich_help_panel=_OUTPUT),
    ] = None,
    view: Annotated[
        str,
        typer.Option(
            metavar="VIEW",
            help="Where it is taken from: overview, bins, belt, agv1, agv2.",
            rich_help_panel=_OUTPUT,
        ),
    ] = "overview",
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose", "-v", metavar="", help="Say also how time kept to the wall clock.", rich_help_panel=_OUTPUT
        ),
    ] = False,
) -> None:
    """Run a trial for programs in other processes, until Ctrl-C; then print its score.

    Programs connect over a socket; what happens is a line each.

        # the lesson's cell, in real time
        cellwright serve lesson

        # time passes only when a program asks for it: the same result on any host
        cellwright serve lesson --lockstep

        # then, in another terminal: your program works that cell
        cellwright run --connect 127.0.0.1:11399 --agent my_robot.py:MyRobot

        # the same cell for programs of ROS 1, with a master if there is none
        cellwright serve lesson --ros1

    Exit status: 0 stopped, by whatever was asked for; 1 the simulation became unstable, or the picture could not be
    written; 2 bad input, and nothing was started.
    """
    wanted = ServeOptions(
        speed=options.speed(("max" if lockstep else "1") if speed is None else speed),
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
        log=options.log_file(log),
        picture=options.picture_file(picture),
        camera=options.camera(view),
        verbose=verbose,
    )
    raise typer.Exit(serve_trial(partial(_trial, files, seed, is_varied=vary), wanted))


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
        port: port to listen at; 0 takes a free one.
        ros1: be the simulator of ROS 1 programs too.
        as_json: print the result as JSON, and nothing else on stdout.
        log: file for what happens.
        picture: file for a picture of the cell at the end.
        camera: where that is taken from.
        verbose: say also how time kept to the wall clock.
    """

    speed: float | None = 1.0
    lockstep: bool = False
    servo: str | None = None
    seed: int | None = None
    competition: bool = True
    until: float | None = None
    ends_when_done: bool = False
    host: str = LOOPBACK
    port: int = DEFAULT_PORT
    ros1: bool = False
    as_json: bool = False
    log: Path | None = None
    picture: Path | None = None
    camera: Camera = VIEWS["overview"]
    verbose: bool = False


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
    is_stopped = _Stop()
    with stopped_by_signals(is_stopped.stop), ExitStack() as to_close:
        trial = load()
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
        progress = RunProgress(console, cell, until=wanted.until)
        report = partial(progress.line, style="yellow")
        if ros is not None:
            ros.report = report
        server = Server(cell, host=wanted.host, port=wanted.port, lockstep=wanted.lockstep, report=report)
        if not server.is_local:
            typer.echo(f"warning: {wanted.host}: anybody who reaches this machine can drive the cell", err=True)
        hooks = Hooks(
            on_ready=lambda: _begin(console, cell, server, wanted.speed, ros),
            on_poll=_nothing if ros is None else ros.poll,
        )
        serving = Serving(cell, server, speed=wanted.speed, hooks=hooks)
        offer_result(serving)
        is_stopped.follow(serving.stop)
        kept = None if wanted.log is None else RunLog(wanted.log, about={"agent": "served"}, report=_warn)
        with progress.running():
            run = RunOptions(until=wanted.until, ends_when_done=wanted.ends_when_done, log=kept)
            result = serving.run(run)
    status = NOT_DONE if result.outcome is Outcome.UNSTABLE else DONE
    if result.error:
        typer.echo(result.error, err=True, nl=False)
    pictures = Pictures(wanted.camera, [], _warn)
    if wanted.picture is not None:
        pictures.take(wanted.picture, cell)
    if pictures.missed:
        status = NOT_DONE
    pace = serving.pace
    if wanted.as_json:
        about = document.of_run(cell, "served", result, status, pictures.written) | {"pace": document.of_pace(pace)}
        typer.echo(json.dumps(about, indent=2))
    else:
        score_table.show(console, result)
        if wanted.verbose and pace is not None:
            score_table.note(console, "pace", _pace_text(pace))
        for written in pictures.written:
            score_table.note(console, "picture", written)
    return status


class _Stop:
    """A wish to end that may come before there is anything to end."""

    def __init__(self) -> None:
        self.has_come = False
        """Whether there is the wish."""
        self._stop: Callable[[], None] = lambda: None

    def stop(self) -> None:
        self.has_come = True
        self._stop()

    def follow(self, stop: Callable[[], None]) -> None:
        self._stop = stop
        if self.has_come:
            stop()


def _begin(console: Console, cell: Cell, server: Server, speed: float | None, ros: Ros1 | None) -> None:
    """Have ROS know the cell, if it is to; then say that it is ready."""
    if ros is None:
        _ready(console, cell, server, speed)
    elif ros.join(server.address, parameters(cell.trial, competition=cell.in_competition), server.wait):
        _ready(console, cell, server, speed, f", ROS 1 at {ros.master.uri}")


def _ready(console: Console, cell: Cell, server: Server, speed: float | None, more: str = "") -> None:
    host, port = server.address
    if server.lockstep:
        pace = "lockstep"
    else:
        pace = "as fast as it goes" if speed is None else "real time" if speed == 1.0 else f"{speed:g} x real time"
    console.print(f"ready: {cell.trial.name} at {host}:{port}, {pace}{more}", markup=False, soft_wrap=True)


def _nothing() -> None:
    pass


def _pace_text(pace: Pace) -> str:
    return f"{pace.factor:.4f} x real time, latest tick {pace.worst_lateness * 1e3:.1f} ms late"


def _trial(files: list[str], seed: int | None, *, is_varied: bool) -> Trial:
    trial, root = options.load(files), options.seed(seed)
    return variation.vary(trial, trial.settings.seed if root is None else root) if is_varied else trial


def _warn(line: str) -> None:
    typer.echo(f"warning: {line}", err=True)
