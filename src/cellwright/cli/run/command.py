"""Command `cellwright run`: a cell from its file to its score."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import nullcontext, redirect_stdout
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cli import arguments, options, output
from cellwright.cli.arguments import (
    END,
    LOOK,
    OUTPUT,
    TRIAL,
    WORK,
    Development,
    Log,
    OpenPage,
    Record,
    Seed,
    Servo,
    Until,
    Vary,
    ViewHost,
    ViewPort,
    page_options,
    refuse_camera_name,
)
from cellwright.cli.run.session import Quality, RunSession
from cellwright.clients.agents.agent import BUNDLED, Agent, find_agent
from cellwright.config.trial.catalogue import bundled_sensors
from cellwright.config.trial.trial import Trial
from cellwright.rendering.backend import requested_backend
from cellwright.running.run import RunOptions

TRANSPORTS = ("socket", "ros1")
"""Ways between an agent and a cell that are in different processes."""


def agent_transport(over: str | None, *, lockstep: bool) -> str | None:
    """The way between agent and cell; None within one process."""
    if over is None and lockstep:
        options.refuse(
            f"--lockstep: say over what as well, such as --over {TRANSPORTS[0]}; in one process it is always so"
        )
    if over is not None and over not in TRANSPORTS:
        options.refuse(f"--over {over}: give {' or '.join(TRANSPORTS)}")
    return over


SAVE, PROCESSES = "Checkpoints", "Agent and cell in two processes"
"""Headings in the help, under which options are listed."""

AgentName = Annotated[
    str,
    typer.Option(
        metavar="AGENT",
        help="What works the cell: `kitter`, `lesson`, your `path.py:Class` or `module:Class`, or `none`.",
        rich_help_panel=WORK,
    ),
]
Speed = Annotated[
    str | None,
    typer.Option(
        metavar="FACTOR",
        help="Simulated seconds a second: `1` is real time, `max` as fast as it goes. `max` when left out, but "
        "`1` with --view, and with --over and no --lockstep.",
        rich_help_panel=WORK,
    ),
]
Over = Annotated[
    str | None,
    typer.Option(
        metavar="WAY",
        help="Run the agent in a process of its own, which comes to the cell over a `socket` or over `ros1`.",
        rich_help_panel=PROCESSES,
    ),
]
Lockstep = Annotated[
    bool,
    typer.Option(
        "--lockstep",
        metavar="",
        help="With --over: let time pass only while the agent waits; the same result as in one process.",
        rich_help_panel=PROCESSES,
    ),
]
Connect = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT",
        help="Work the cell that `cellwright serve` has there, instead of one of TRIAL.",
        rich_help_panel=PROCESSES,
    ),
]
MinScore = Annotated[
    float | None,
    typer.Option(metavar="POINTS", help="Exit with status 1 when the score is below.", rich_help_panel=END),
]
Snapshots = Annotated[
    list[str] | None,
    typer.Option(
        metavar="T:FILE.png", help="Take a picture at a simulation time [s]; repeatable.", rich_help_panel=LOOK
    ),
]
View = Annotated[
    bool,
    typer.Option(
        "--view",
        metavar="",
        help="Show it on a page, in a browser; the page's address is printed. The page stays after the run, until "
        "Ctrl-C; with --json it ends with the run.",
        rich_help_panel=LOOK,
    ),
]
WithPicture = Annotated[
    bool, typer.Option("--picture/--no-picture", metavar="", help="Write TRIAL.png at the end.", rich_help_panel=LOOK)
]
TakenFrom = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="Where pictures are taken from: overview, bins, belt, agv1, agv2, or `x,y,z:x,y,z` [m].",
        rich_help_panel=LOOK,
    ),
]
HowDrawn = Annotated[
    Quality,
    typer.Option(
        metavar="HOW",
        help="How pictures are drawn: `fine`, by rays, or `fast`, by OpenGL as videos are.",
        rich_help_panel=LOOK,
    ),
]
Checkpoints = Annotated[
    list[str] | None,
    typer.Option(
        metavar="T:FILE.npz",
        help="Save the simulation at this time [s]; repeatable. It is an event of the run: the state hash changes.",
        rich_help_panel=SAVE,
    ),
]
Resume = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.npz", help="Begin from what --checkpoint saved; the agent begins anew.", rich_help_panel=SAVE
    ),
]
Listen = Annotated[
    list[str] | None,
    typer.Option(
        metavar="TOPIC", help="Count a topic's messages, `all` for every topic; repeatable.", rich_help_panel=LOOK
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json", metavar="", help="Print the result as JSON, and nothing else on stdout.", rich_help_panel=OUTPUT
    ),
]
TeamAverages = Annotated[
    str | None,
    typer.Option(
        metavar="COST,TIME",
        help="Score the trial as in the finals, against these averages of all teams [$, s]; a time for each order.",
        rich_help_panel=OUTPUT,
    ),
]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", metavar="", help="Say what the agent logs.", rich_help_panel=OUTPUT)
]


_OF_THE_AGENT = ("connect", "agent", "min_score", "as_json", "verbose", "picture")


def run(
    context: typer.Context,
    files: Annotated[list[str] | None, TRIAL] = None,
    agent: AgentName = "kitter",
    servo: Servo = None,
    seed: Seed = None,
    vary: Vary = False,
    speed: Speed = None,
    over: Over = None,
    lockstep: Lockstep = False,
    connect: Connect = None,
    development: Development = False,
    until: Until = None,
    min_score: MinScore = None,
    snapshot: Snapshots = None,
    picture: WithPicture = True,
    camera: TakenFrom = "overview",
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    open_page: OpenPage = False,
    quality: HowDrawn = Quality.FINE,
    video: arguments.VideoFile = None,
    video_camera: arguments.VideoCamera = None,
    video_speed: arguments.VideoSpeed = 1.0,
    video_size: arguments.VideoSize = arguments.DEFAULT_VIDEO_SIZE,
    video_fine: arguments.VideoFine = False,
    checkpoint: Checkpoints = None,
    resume: Resume = None,
    listen: Listen = None,
    as_json: AsJson = False,
    log: Log = None,
    record: Record = None,
    averages: TeamAverages = None,
    verbose: Verbose = False,
) -> None:
    """Run a trial headless, and print its score.

    The referee judges the kits that the agent sends off; a picture of the cell at the end is written beside.

        # the lesson's cell, worked by the agent that comes along
        cellwright run lesson

        # the same on a page in your browser: pause it, slow it down, see where each point comes from
        cellwright run lesson --view

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
        cellwright run lesson --agent none --until 10 --camera belt

    Exit status: 0 done; 1 not done (time limit, the time of --until came before the agent was done, agent gave up or
    crashed, stopped, below --min-score), or a file that was asked for is not whole; 2 bad input, and nothing was
    started.
    """
    least = options.min_score(min_score)
    if connect is not None:
        _refuse_what_is_settled(context)
        from cellwright.cli.run.remote import run_connected

        run_connected(agent, connect, as_json=as_json, min_score=least)
    if not files:
        options.refuse("give a trial, such as lesson; cellwright trials lists those that come along")
    refuse_camera_name(files, view=view)
    if quality is Quality.FAST:
        requested_backend()
    page = page_options(view=view, host=view_host, port=view_port, opens=open_page)
    way = agent_transport(over, lockstep=lockstep)
    wanted = RunOptions(
        speed=options.speed(speed or ("max" if page is None and (way is None or lockstep) else "1")),
        until=options.until(until),
        listen=listen or (),
        checkpoints=[options.timed_file("--checkpoint", text, ".npz") for text in checkpoint or ()],
        start=resume,
    )
    log_file = options.output_file("--log", log, ".jsonl")
    kept = arguments.record_options(record, agent=agent)
    filmed = arguments.video_options(video, video_camera, video_speed, video_size, fine=video_fine)
    place = options.camera(camera)
    snapshots = [options.timed_file("--snapshot", text, ".png") for text in snapshot or ()]
    console = Console(stderr=as_json, highlight=False)
    with redirect_stdout(sys.stderr) if as_json else nullcontext():  # what a file brings along prints no JSON
        trial, kept = arguments.read_with_sources(
            kept, partial(options.trial, files, seed, is_varied=vary), lambda _: options.paths(files)
        )
        cell = _build(trial, seed, servo, console, competition=not development)
        options.topics(wanted.listen, cell)
        spent = options.averages(averages, cell.trial)
        maker = _maker(agent, wanted)
        worker = maker() if maker is not None and way is None else None
    if maker and not cell.trial.has_arm:
        _miss_arm(cell.trial.name, agent)
    varied = ", varied" if vary else ""
    console.print(f"trial {cell.trial.name}{varied}, agent {agent}, seed {cell.seed}, servo {cell.servo}", markup=False)
    turn = RunSession(
        cell=cell,
        agent=agent,
        make=maker,
        worker=worker,
        options=wanted,
        console=console,
        way=way,
        lockstep=lockstep,
        verbose=verbose,
        camera=place,
        quality=quality,
        snapshots=snapshots,
        picture=picture,
        video=filmed,
        log=log_file,
        record=kept if kept is None else replace(kept, is_varied=vary),
        least=least,
        spent=spent,
        as_json=as_json,
    )
    if page is None:
        raise typer.Exit(turn.play())
    # what looking on and other processes need is loaded where somebody wants it, which the other runs are spared
    from cellwright.cli.page import ViewedRun

    say = partial(console.print, markup=False, soft_wrap=True)
    with ViewedRun(
        cell,
        page,
        speed=wanted.speed,
        lockstep=lockstep,
        apart=way is not None,
        keeps=not as_json,
        about={"agent": agent},
        say=say,
    ) as turn.attended:
        status = turn.play()
        while not turn.is_interrupted and turn.attended.stays():
            status = turn.play()
    raise typer.Exit(status)


def _refuse_what_is_settled(context: typer.Context) -> None:
    """With --connect the cell is there already: refuse options that would make one, or look into it."""
    for parameter in context.command.params:
        name = parameter.name or ""
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE" and name not in _OF_THE_AGENT:
            given = max(parameter.opts, key=len) if name != "files" else "TRIAL"
            options.refuse(f"--connect: the cell is there already, and {given} is for the one who serves it")


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
    output.warn(f"{trial}: the trial has no arm; {remedy}")
