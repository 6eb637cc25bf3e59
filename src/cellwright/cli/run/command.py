"""`cellwright run`: a cell from its file to its score."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright import variation
from cellwright.agents.agent import BUNDLED, Agent, find_agent
from cellwright.cell import Cell
from cellwright.cli import exit_status, options, videos
from cellwright.cli.arguments import END, OUTPUT, TRIAL, WORK, Development, Log, Seed, Servo, Until, Vary
from cellwright.cli.run import document, score_table
from cellwright.cli.run import over as run_over
from cellwright.cli.run.pictures import Pictures
from cellwright.cli.run.progress import RunProgress, bar
from cellwright.cli.signals import ended_as_by_ctrl_c
from cellwright.description.catalogue import bundled_sensors
from cellwright.description.trial import Trial
from cellwright.errors import UsageError
from cellwright.kitting.score.scorer import GameScore
from cellwright.kitting.score.trial_score import Averages, TrialScore, trial_score
from cellwright.recording.run_log import RunLog
from cellwright.run import Outcome, RunOptions, run_cell

_LOOK, _SAVE = "Looking on", "Checkpoints"
_OF_THE_AGENT = ("connect", "agent", "min_score", "as_json", "verbose", "picture")
_PROCESSES = "Agent and cell in two processes"


def run(
    context: typer.Context,
    files: Annotated[list[str] | None, TRIAL] = None,
    agent: Annotated[
        str,
        typer.Option(
            metavar="AGENT",
            help="What works the cell: `kitter`, `lesson`, your `path.py:Class` or `module:Class`, or `none`.",
            rich_help_panel=WORK,
        ),
    ] = "kitter",
    servo: Servo = None,
    seed: Seed = None,
    vary: Vary = False,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="FACTOR",
            help="Simulated seconds a second: `1` is real time, `max` as fast as it goes. `max` when left out, but "
            "`1` with --over and no --lockstep.",
            rich_help_panel=WORK,
        ),
    ] = None,
    over: Annotated[
        str | None,
        typer.Option(
            metavar="WAY",
            help="Run the agent in a process of its own, which comes to the cell over a `socket` or over `ros1`.",
            rich_help_panel=_PROCESSES,
        ),
    ] = None,
    lockstep: Annotated[
        bool,
        typer.Option(
            "--lockstep",
            metavar="",
            help="With --over: let time pass only while the agent waits; the same result as in one process.",
            rich_help_panel=_PROCESSES,
        ),
    ] = False,
    connect: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT",
            help="Work the cell that `cellwright serve` has there, instead of one of TRIAL.",
            rich_help_panel=_PROCESSES,
        ),
    ] = None,
    development: Development = False,
    until: Until = None,
    min_score: Annotated[
        float | None,
        typer.Option(metavar="POINTS", help="Exit with status 1 when the score is below.", rich_help_panel=END),
    ] = None,
    snapshot: Annotated[
        list[str] | None,
        typer.Option(
            metavar="T:FILE.png", help="Take a picture at a simulation time [s]; repeatable.", rich_help_panel=_LOOK
        ),
    ] = None,
    picture: Annotated[
        bool,
        typer.Option("--picture/--no-picture", metavar="", help="Write TRIAL.png at the end.", rich_help_panel=_LOOK),
    ] = True,
    view: Annotated[
        str,
        typer.Option(
            metavar="VIEW",
            help="Where pictures are taken from: overview, bins, belt, agv1, agv2.",
            rich_help_panel=_LOOK,
        ),
    ] = "overview",
    video: videos.File = None,
    video_camera: videos.View = None,
    video_speed: videos.Speed = 1.0,
    video_size: videos.Size = videos.USUAL_SIZE,
    video_fine: videos.Fine = False,
    checkpoint: Annotated[
        list[str] | None,
        typer.Option(
            metavar="T:FILE.npz", help="Save the simulation at this time [s]; repeatable.", rich_help_panel=_SAVE
        ),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.npz", help="Begin from what --checkpoint saved; the agent begins anew.", rich_help_panel=_SAVE
        ),
    ] = None,
    listen: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TOPIC", help="Count a topic's messages, `all` for every topic; repeatable.", rich_help_panel=_LOOK
        ),
    ] = None,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            metavar="",
            help="Print the result as JSON, and nothing else on stdout.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    log: Log = None,
    averages: Annotated[
        str | None,
        typer.Option(
            metavar="COST,TIME",
            help="Score the trial as in the finals, against these averages of all teams [$, s]; a time for each order.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", metavar="", help="Say what the agent logs.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Run a trial headless, and print its score.

    The referee judges the kits that the agent sends off; a picture of the cell at the end is written beside.

        # the lesson's cell, worked by the agent that comes along
        cellwright run lesson

        # worked by the lesson's own script
        cellwright run lesson --agent lesson

        # worked by your program: a class with a method run(client)
        cellwright run lesson --agent my_robot.py:MyRobot

        # in CI: status 1 below 8 points, and the result as JSON
        cellwright run trial.yaml --agent my_robot.py:MyRobot --min-score 8 --json

        # the same in two processes, as a program of its own would meet the cell
        cellwright run lesson --over socket --lockstep

        # the same in ROS 1, with a master if there is none
        cellwright run lesson --over ros1 --lockstep

        # nobody at work: the cell itself, seen by the belt after ten seconds
        cellwright run lesson --agent none --until 10 --view belt

    Exit status: 0 done; 1 not done (time limit, agent gave up or crashed, stopped, below --min-score); 2 bad input,
    and nothing was started.
    """
    least = options.min_score(min_score)
    if connect is not None:
        _refuse_what_is_settled(context)
        run_over.connected(agent, connect, as_json=as_json, min_score=least)
    if not files:
        options.refuse("give a trial, such as lesson; cellwright trials lists those that come along")
    way = run_over.way(over, lockstep=lockstep)
    wanted = RunOptions(
        speed=options.speed(speed or ("max" if way is None or lockstep else "1")),
        until=options.until(until),
        listen=listen or (),
        checkpoints=[options.timed_file("--checkpoint", text, ".npz") for text in checkpoint or ()],
        start=resume,
    )
    log_file = options.log_file(log)
    filmed = videos.wish(video, video_camera, video_speed, video_size, fine=video_fine)
    pictures = Pictures(
        options.camera(view), [options.timed_file("--snapshot", text, ".png") for text in snapshot or ()], _warn
    )
    console = Console(stderr=as_json, highlight=False)
    with redirect_stdout(sys.stderr) if as_json else nullcontext():  # what an agent prints is no JSON
        cell = _build(_trial(files, seed, is_varied=vary), seed, servo, console, competition=not development)
        options.topics(wanted.listen, cell)
        spent = options.averages(averages, cell.trial)
        maker = _maker(agent, wanted)
        worker = maker() if maker is not None and way is None else None
        if maker and not cell.trial.has_arm:
            _miss_arm(cell.trial.name, agent)
        varied = ", varied" if vary else ""
        console.print(
            f"trial {cell.trial.name}{varied}, agent {agent}, seed {cell.seed}, servo {cell.servo}", markup=False
        )
        progress = RunProgress(console, cell, until=wanted.until, verbose=verbose)
        kept = None if log_file is None else RunLog(log_file, about={"agent": agent}, report=_warn)
        film = None if filmed is None else videos.of_cell(cell, filmed, waits=wanted.speed is None, warn=_warn)
        actions = [*videos.actions(film), *pictures.actions()]
        wanted = replace(wanted, at=actions, on_progress=progress.update, log=kept)
        with progress.running(), ended_as_by_ctrl_c():
            if maker is None or way is None:
                result = run_cell(cell, worker, wanted)
            else:
                report = partial(progress.line, style="yellow")
                result = run_over.hosted(
                    cell, agent, wanted, way=way, lockstep=lockstep, verbose=verbose, report=report
                )
    pictures.finish(cell.simulation.time)
    made = [] if film is None else [film.finish()]
    final = None if spent is None else finals_score(cell.trial, result.score, spent)
    if result.error:
        sys.stderr.write(result.error)
    status = exit_status.of_run(result, has_agent=maker is not None, min_score=least)
    is_whole = (kept is None or kept.lines.is_whole) and (film is None or film.is_whole)
    if pictures.missed or cell.checkpoints.missed or not is_whole:
        status = status or exit_status.NOT_DONE  # what was asked for is not all there
    if not as_json:
        score_table.show(console, result, final)
        if least is not None and result.score.total < least:
            score_table.note(console, "not enough", f"{least:g} points were asked for")
    if picture and result.outcome is not Outcome.INTERRUPTED:
        file = Path(f"{cell.trial.name}.png")
        with bar(console, f"drawing {file}", 1.0) as tell:
            pictures.take(file, cell, tell)
    if as_json:
        about = document.of_run(cell, agent, result, status, pictures.written, final)
        typer.echo(json.dumps(about | {"videos": made}, indent=2))
    else:
        for each in made:
            score_table.note(console, "video", videos.sentence(each))
        for written in pictures.written:
            score_table.note(console, "picture", written)
    raise typer.Exit(status)


def finals_score(trial: Trial, score: GameScore, spent: Averages) -> TrialScore | None:
    """The score of the trial; without one, such as after points in no time, the run still has its result."""
    try:
        return trial_score(trial.sensors, score.orders, spent)
    except UsageError as error:
        _warn(f"the trial has no score: {error}")
        return None


def _refuse_what_is_settled(context: typer.Context) -> None:
    """With --connect the cell is there already: refuse options that would make one, or look into it."""
    for parameter in context.command.params:
        name = parameter.name or ""
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE" and name not in _OF_THE_AGENT:
            given = max(parameter.opts, key=len) if name != "files" else "TRIAL"
            options.refuse(f"--connect: the cell is there already, and {given} is for the one who serves it")


def _trial(files: Sequence[str], seed: int | None, *, is_varied: bool) -> Trial:
    trial, root = options.load(files), options.seed(seed)
    return variation.vary(trial, trial.settings.seed if root is None else root) if is_varied else trial


def _build(trial: Trial, seed: int | None, servo: str | None, console: Console, *, competition: bool) -> Cell:
    return Cell(
        trial,
        seed=options.seed(seed),
        servo=options.servo(servo),
        competition=competition,
        report=partial(console.print, markup=False, soft_wrap=True, style="yellow"),
    )


def _maker(name: str, wanted: RunOptions) -> Callable[[], Agent] | None:
    if name != "none":
        return find_agent(name)
    if wanted.until is None:
        options.refuse("--agent none: without an agent a run has no end; say --until SECONDS")
    return None


def _miss_arm(trial: str, agent: str) -> None:
    """Say what a trial without an arm lacks. Only somebody's own program may have a use for it."""
    remedy = f"give a file with one as well, such as: cellwright run {trial} {bundled_sensors()[0]}"
    if agent in BUNDLED:
        options.refuse(f"{trial}: the trial has no arm for the agent {agent} to work with; {remedy}")
    _warn(f"{trial}: the trial has no arm; {remedy}")


def _warn(line: str) -> None:
    typer.echo(f"warning: {line}", err=True)
