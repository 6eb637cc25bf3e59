"""Command `cellwright run`: a cell from its file to its score."""

import logging
import shlex
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext, redirect_stdout, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.scorer import Averages, GameScore, TrialScore, trial_score
from cellwright.cli import arguments, options, output
from cellwright.cli.arguments import AGENT_HELP, END, LOCKSTEP_HELP, OUTPUT, SIMULATION, SPEED_HELP, VIEWING
from cellwright.cli.main import exit_status_of, flag, option
from cellwright.cli.signals import ended_as_by_ctrl_c, stopped_by_signals
from cellwright.cli.summary import RunProgress, show_files, show_result
from cellwright.clients.agents.agent import BUNDLED, Agent, find_agent
from cellwright.config.trial.catalogue import bundled_sensors
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.joining import joined_name
from cellwright.config.trial.trial import Trial
from cellwright.engine.rate_control import RateControl
from cellwright.rendering.backend import requested_backend
from cellwright.running.run import Outcome, Program, RunOptions, ServerOptions, Session
from cellwright.running.run.observers import Pictures, Quality
from cellwright.running.run.targets import cell_result
from cellwright.util.errors import CellwrightError, UsageError

AGENT_IN_OWN_PROCESS = "the agent runs in its own process; end the run and start it again"
"""Reason why a run over a socket or ROS cannot start again from the page."""

SAVE, PROCESSES = "Checkpoints", "Agent and cell in two processes"
"""Headings for options in the help."""

AgentName = Annotated[str, option("AGENT", f"{AGENT_HELP}; `none` for no agent.", SIMULATION)]
Speed = Annotated[
    str | None,
    option(
        "FACTOR", f"{SPEED_HELP} Default: `max`, but `1` with --view, and with --over and no --lockstep.", SIMULATION
    ),
]
Over = Annotated[
    str | None,
    option(
        "TRANSPORT",
        "Run the agent in its own process, connected to the cell over a `socket`, `ros1` or `ros2`.",
        PROCESSES,
    ),
]
Lockstep = Annotated[
    bool, flag("--lockstep", f"{LOCKSTEP_HELP}; requires --over, and gives the same result as one process.", PROCESSES)
]
Connect = Annotated[
    str | None,
    option("HOST:PORT", "Work the cell that `cellwright serve` serves at this address, instead of a TRIAL.", PROCESSES),
]
MinScore = Annotated[float | None, option("POINTS", "Exit with status 1 if the score is less.", END)]
Snapshots = Annotated[
    list[str] | None, option("T:FILE.png", "Take a picture at a simulation time [s]; repeatable.", VIEWING)
]
WithPicture = Annotated[bool, flag("--picture/--no-picture", "Write TRIAL.png at the end.", VIEWING)]
PictureQuality = Annotated[
    Quality, option("QUALITY", "Quality of pictures: `fast`, by OpenGL as in videos, or `fine`, by rays.", VIEWING)
]
Checkpoints = Annotated[
    list[str] | None,
    option(
        "T:FILE.npz",
        "Save a checkpoint at this simulation time [s]; repeatable. It changes the state hash of the run.",
        SAVE,
    ),
]
Resume = Annotated[
    Path | None, option("FILE.npz", "Resume from a checkpoint; the agent starts from its beginning.", SAVE)
]
Listen = Annotated[
    list[str] | None, option("TOPIC", "Count the messages of a topic, or of `all`; repeatable.", VIEWING)
]
TeamAverages = Annotated[
    str | None,
    option(
        "COST,TIME",
        "Score the trial as in the finals, from these averages of all teams [$, s], with a time for each order.",
        OUTPUT,
    ),
]
Verbose = Annotated[bool, flag("--verbose -v", "Print the agent's log messages.", OUTPUT)]


_OF_THE_AGENT = ("connect", "agent", "min_score", "as_json", "verbose", "picture")


def run(
    context: typer.Context,
    files: Annotated[list[str] | None, arguments.TRIAL] = None,
    agent: AgentName = "kitter",
    servo: arguments.Servo = None,
    seed: arguments.Seed = None,
    vary: arguments.Vary = False,
    overrides: arguments.Overrides = None,
    speed: Speed = None,
    over: Over = None,
    lockstep: Lockstep = False,
    connect: Connect = None,
    development: arguments.Development = False,
    until: arguments.Until = None,
    min_score: MinScore = None,
    snapshot: Snapshots = None,
    picture: WithPicture = True,
    camera: arguments.PictureCamera = "overview",
    view: arguments.RunView = False,
    view_host: arguments.ViewHost = None,
    view_port: arguments.ViewPort = None,
    open_page: arguments.OpenPage = False,
    quality: PictureQuality = Quality.FAST,
    video: arguments.VideoFile = None,
    video_camera: arguments.VideoCamera = None,
    video_speed: arguments.VideoSpeed = 1.0,
    video_size: arguments.VideoSize = arguments.DEFAULT_VIDEO_SIZE,
    video_fine: arguments.VideoFine = False,
    checkpoint: Checkpoints = None,
    resume: Resume = None,
    listen: Listen = None,
    as_json: arguments.AsJson = False,
    log: arguments.Log = None,
    record: arguments.Record = None,
    averages: TeamAverages = None,
    verbose: Verbose = False,
) -> None:
    """Run a trial headless, and print its score.

    The referee scores the kits that the agent submits. A picture of the cell at the end goes to TRIAL.png.

        # the lesson's cell, with the bundled agent
        cellwright run lesson

        # the same on a page in your browser: pause it, slow it down, see where each point comes from
        cellwright run lesson --view

        # with the lesson's own script
        cellwright run lesson --agent lesson

        # with your agent: a class with a method run(client)
        cellwright run lesson --agent my_robot.py:MyRobot

        # in CI: status 1 below 8 points, and the result as JSON
        cellwright run trial.yaml --agent my_robot.py:MyRobot --min-score 8 --json

        # agent and cell in two processes
        cellwright run lesson --over socket --lockstep

        # the same over ROS 1; starts a master if there is none
        cellwright run lesson --over ros1 --lockstep

        # no agent: the cell alone, with a picture of the belt after ten seconds
        cellwright run lesson --agent none --until 10 --camera belt

    Exit status: 0 done; 1 not done, or a requested file is incomplete; 2 bad input, and nothing was started; 3 the
    trial has no order. Not done are runs that end by a time limit, by --until before the agent, by a signal, by an
    agent that gave up or crashed, or below --min-score.
    """
    threshold = options.min_score(min_score)
    if connect is not None:
        _refuse_cell_options(context)
        from cellwright.cli.run.remote import run_connected

        run_connected(agent, connect, as_json=as_json, min_score=threshold)
    if not files:
        options.refuse("no trial given; name one such as lesson (cellwright trials lists the bundled ones)")
    arguments.refuse_camera_name(files, view=view)
    if quality is Quality.FAST and (picture or snapshot):
        requested_backend()
    page = arguments.page_options(view=view, host=view_host, port=view_port, opens=open_page)
    if over is None and lockstep:
        options.refuse("--lockstep requires --over (for example --over socket); in-process runs are always lockstep")
    if over not in (None, "socket", "ros1", "ros2"):
        options.refuse(f"--over {over}: give socket, ros1 or ros2")
    rate = options.speed(speed or ("max" if page is None and (over is None or lockstep) else "1"))
    run_options = RunOptions(
        listen=listen or (),
        checkpoints=[options.timed_file("--checkpoint", text, ".npz") for text in checkpoint or ()],
        start=resume,
    )
    log_file = options.output_file("--log", log, ".jsonl")
    kept = arguments.record_options(record, agent=agent)
    filmed = arguments.video_options(video, video_camera, video_speed, video_size, fine=video_fine)
    place = options.camera(camera)
    pictures = Pictures(
        place, [options.timed_file("--snapshot", text, ".png") for text in snapshot or ()], output.warn, quality
    )
    console = Console(stderr=as_json, highlight=False)
    progress = RunProgress(console, until=options.until(until), verbose=verbose)
    print_out = partial(console.print, markup=False, soft_wrap=True)
    session = Session(
        options.cell_of(
            *(files, console),
            overrides=options.overrides(overrides),
            seed=seed,
            servo=servo,
            is_varied=vary,
            competition=not development,
            agent=agent,
        ),
        until=until,
        rate=rate if page is None else RateControl(rate),
        lockstep=lockstep,
        serve=ServerOptions(port=0) if over else False,
        view=page or False,
        ros1=over == "ros1",
        ros2=over == "ros2",
        record=kept and replace(kept, is_varied=vary),
        video=filmed,
        log=log_file,
        about={"agent": agent},
        observers=[pictures, progress],
        options=run_options,
        **output.session_outputs(console, partial(progress.line, style="yellow")),
    )
    session.restart_refusal = AGENT_IN_OWN_PROCESS if over else ""
    program = _program(agent, over, has_end=until is not None, is_verbose=verbose)
    with ExitStack() as leaving:
        out = sys.stdout
        if as_json:  # output of files and agents is no JSON
            leaving.enter_context(redirect_stdout(sys.stderr))
        if over:
            leaving.enter_context(stopped_by_signals(session.stop.request))
        leaving.enter_context(session)
        cell: Cell = session.node
        options.topics(run_options.listen, cell)
        spent = options.averages(averages, cell.trial)
        worker = program()
        if worker is not None and not cell.trial.has_arm:
            _warn_of_missing_arm(cell.trial.name, files or (), agent)
        changes = "".join(f", {each}" for each in [*cell.trial.overrides, *(["varied"] if vary else [])])
        print_out(
            f"trial {cell.trial.name}{changes}, agent {agent}, seed {cell.seed}, servo {cell.servo}", soft_wrap=False
        )
        while True:
            with nullcontext() if over else ended_as_by_ctrl_c():
                result = cell_result(session.run(worker))
            status = exit_status_of(result, has_agent=worker is not None, min_score=threshold)
            if not session.restart_requested:
                sys.stderr.write(result.error)
                final = None if spent is None else finals_score(cell.trial, result.score, spent)
                if not as_json:
                    show_result(console, result, final)
                    if threshold is not None and result.score.total < threshold:
                        output.print_entry(console, "not enough", f"below --min-score {threshold:g}")
                end = Path(f"{cell.trial.name}.png") if picture and result.outcome is not Outcome.INTERRUPTED else None
                to = out if as_json else None
                status = show_files(console, session, agent, status, pictures, end, final, out=to)
            if result.outcome is Outcome.INTERRUPTED or not _wait_for_restart(session, print_out, keeps=not as_json):
                raise typer.Exit(status)
            worker = program()


def _wait_for_restart(session: Session, on_message: Callable[[str], None], *, keeps: bool) -> bool:
    """Keep the page until Ctrl-C, SIGTERM or SIGHUP if it is to stay; return whether to start the run again instead."""
    if session.restart_requested:
        on_message("run restarted")
        return True
    if session.page is None or not keeps:
        return False
    with suppress(KeyboardInterrupt), ended_as_by_ctrl_c():
        on_message("the page stays open until Ctrl-C")  # once the handlers of signals are set
        return session.wait()
    return False


def _program(agent: str, over: str | None, *, has_end: bool, is_verbose: bool) -> Callable[[], Agent | Program | None]:
    """Return a factory for each run: an agent of its own, the agent in a process of its own, or None for no agent."""
    if agent == "none":
        if not has_end:
            options.refuse("--agent none requires --until SECONDS: without an agent a run has no end")
        return lambda: None
    make = find_agent(agent)
    if over is None:
        return make
    from cellwright.running.remote.hosting import RemoteAgent

    def print_line(line: str) -> None:
        sys.stdout.write(f"{line}\n")

    remote = RemoteAgent(agent, level=logging.INFO if is_verbose else logging.WARNING, on_message=print_line)
    return lambda: remote


def _refuse_cell_options(context: typer.Context) -> None:
    """With --connect the cell runs already: refuse options that would make one, or read its state."""
    for parameter in context.command.params:
        name = parameter.name or ""
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE" and name not in _OF_THE_AGENT:
            given = max(parameter.opts, key=len) if name != "files" else "TRIAL"
            options.refuse(f"--connect: {given} is for the process that serves the cell; leave it out")


def finals_score(trial: Trial, score: GameScore, spent: Averages) -> TrialScore | None:
    """Return the score of the trial in the finals; on an error the run still has its result."""
    try:
        return trial_score(trial.sensors, score.orders, spent)
    except UsageError as error:
        output.warn(f"the trial has no finals score: {error}")
        return None


def _warn_of_missing_arm(trial: str, files: Sequence[str], agent: str) -> None:
    """Warn about a trial without an arm. Only a user's own program may have a use for it."""
    joined = joined_name([*files, bundled_sensors()[0]])
    remedy = f"add a file with one, such as: {shlex.join(['cellwright', 'run', joined])}"
    try:
        load_trial(options.paths([joined]))
    except CellwrightError:  # not every text can be continued by another one
        remedy = "add one to the file, such as `arm: {type: ur10}`, and sensors"
    if agent in BUNDLED:
        options.refuse(f"{trial}: the trial has no arm, and agent {agent} requires one; {remedy}")
    output.warn(f"{trial}: the trial has no arm; {remedy}")
