"""Command `cellwright run`: a cell from its file to its score."""

import json
import shlex
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext, redirect_stdout, suppress
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import TextIO

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.scorer import Averages, GameScore, TrialScore, trial_score
from cellwright.cli import options, output
from cellwright.cli.arguments import record_options
from cellwright.cli.main import exit_status_of
from cellwright.cli.parameters import with_groups
from cellwright.cli.policies import DEFAULT, PolicyArguments
from cellwright.cli.run.arguments import RunArguments
from cellwright.cli.run.policy import PolicyRun, policy_of
from cellwright.cli.signals import ended_as_by_ctrl_c, stopped_by_signals
from cellwright.cli.summary import RunProgress, result_document, show_files, show_result, take_picture, with_files
from cellwright.clients.agents.agent import BUNDLED, OPERATOR, Agent
from cellwright.config.trial.catalogue import bundled_sensors
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.joining import joined_name
from cellwright.config.trial.trial import Trial
from cellwright.engine.rate_control import RateControl
from cellwright.running.run import Outcome, RunResult, ServerOptions, Session, cell_result
from cellwright.running.run.observers import Pictures
from cellwright.util.errors import CellwrightError, UsageError

AGENT_IN_OWN_PROCESS = "the agent runs in its own process; end the run and start it again"
"""Reason why a run over a socket or ROS cannot start again from the page."""

_OF_THE_AGENT = (
    "connect",
    "agent",
    "min_score",
    "as_json",
    "verbose",
    "picture",
    *(each.name for each in fields(PolicyArguments)),
)


@with_groups
def run(context: typer.Context, given: RunArguments) -> None:
    """Run a trial headless, and print its score.

    The referee scores the kits that the agent submits. A picture of the cell at the end goes to TRIAL.png.

        # the lesson's cell, with the bundled agent
        cellwright run lesson

        # the same on a page in your browser: pause it, slow it down, see where each point comes from
        cellwright run lesson --view

        # with the lesson's own script
        cellwright run lesson --agent lesson

        # a person works the cell, on the page that opens
        cellwright run lesson --operator --record run.mcap

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
    agent that gave up or crashed, or below --min-score. A trial's task must succeed.
    """
    with ExitStack() as leaving:
        given, policy = _prepared(given, context, leaving)
        console, over = Console(stderr=given.as_json, highlight=False), given.process.over
        print_out = partial(console.print, markup=False, soft_wrap=True)
        pictures = given.viewing.pictures()
        session = _session(given, pictures, console)
        program_of = partial(given.process.program, has_end=given.until is not None, is_verbose=given.verbose)
        program = program_of(given.agent if policy is None else policy.spec.words)
        out = sys.stdout
        # Output of files and agents is no JSON.
        if given.as_json:
            leaving.enter_context(redirect_stdout(sys.stderr))
        if over:
            leaving.enter_context(stopped_by_signals(session.stop.request))
        leaving.enter_context(session)
        cell: Cell = session.node
        for name in given.viewing.listen or ():
            if name != "all":
                with options.errors_of("--listen"):
                    cell.bus.topic(name)
        options.averages(given.averages, cell.trial)
        if policy is not None:
            program = program_of(policy.agent(cell))
        elif given.agent == OPERATOR and not over:
            program = partial(_operator, cell)
            if session.address is not None:
                host, port = session.address
                print_out(f"operator: works on the page, and over topics at {host}:{port}")
        worker = program()
        needs_arm = given.agent in BUNDLED and given.agent != OPERATOR
        moves = cell.trial.has_arm or (cell.trial.layout.robots and not needs_arm)
        if worker is not None and not moves:
            _warn_of_missing_arm(cell.trial.name, given.files or (), given.agent)
        changes = "".join(f", {each}" for each in [*cell.trial.overrides, *(["varied"] if given.cell.vary else [])])
        facts = f"agent {given.agent}, seed {cell.seed}, servo {cell.servo}"
        print_out(f"trial {cell.trial.name}{changes}, {facts}", soft_wrap=False)
        while True:
            with nullcontext() if over else ended_as_by_ctrl_c():
                result = cell_result(session.run(worker))
            status = exit_status_of(result, has_agent=worker is not None, min_score=given.min_score)
            status = with_files(status, cell, result, pictures)
            if not session.restart_requested:
                sys.stderr.write(result.error)
                _show(given, cell, result, status, pictures, console, out)
            keeps = not given.as_json
            if result.outcome is Outcome.INTERRUPTED or not _wait_for_restart(session, print_out, keeps=keeps):
                raise typer.Exit(status)
            worker = program()


def _prepared(given: RunArguments, context: typer.Context, leaving: ExitStack) -> tuple[RunArguments, PolicyRun | None]:
    """Refuse arguments that do not go together; return them with the name of a policy in place of an agent's.

    With `--connect` it works the served cell, and exits.
    """
    options.in_range("--min-score", given.min_score, -options.FINITE, options.FINITE, "a number")
    if given.operator:
        given = _with_operator(given)
    policy = policy_of(given.policy, leaving, given.agent)
    if given.process.connect is not None:
        _refuse_cell_options(context)
        from cellwright.cli.run.remote import run_connected

        agent = given.agent if policy is None else policy.spec.words
        run_connected(agent, given.process.connect, as_json=given.as_json, min_score=given.min_score)
    if not given.files:
        options.refuse("no trial given; name one such as lesson (cellwright trials lists the bundled ones)")
    given.process.refuse()
    if policy is None:
        return given, None
    policy.refuse(over=given.process.over, lockstep=given.process.lockstep)
    return replace(given, agent=policy.name), policy


def _with_operator(given: RunArguments) -> RunArguments:
    """Return the arguments with the agent of a person, and the page that it is worked on."""
    process = given.process
    others = {
        "--agent": given.agent not in (DEFAULT, OPERATOR),
        "--policy": given.policy.policy is not None,
        "--over": process.over is not None,
        "--connect": process.connect is not None,
    }
    for name, is_given in others.items():
        if is_given:
            options.refuse(f"--operator: {name} does not go with it; a person works the cell in this process")
    page = replace(given.viewing.page, view=True)
    return replace(given, agent=OPERATOR, viewing=replace(given.viewing, page=page))


def _operator(cell: Cell) -> Agent:
    """Return the agent of a person, who sees parts and belts as the page does."""
    from cellwright.clients.agents.operator.agent import OperatorAgent
    from cellwright.running.run.surroundings import CellSurroundings

    return OperatorAgent(CellSurroundings(cell))


def _show(
    given: RunArguments, cell: Cell, result: RunResult, status: int, pictures: Pictures, console: Console, out: TextIO
) -> None:
    """Print the result, to `out` as JSON, and write the picture at the end."""
    spent = options.averages(given.averages, cell.trial)
    final = None if spent is None else finals_score(cell.trial, result.score, spent)
    if not given.as_json:
        show_result(console, result, final)
        if given.min_score is not None and result.score.total < given.min_score:
            output.print_entry(console, "not enough", f"below --min-score {given.min_score:g}")
    if given.viewing.picture and result.outcome is not Outcome.INTERRUPTED:
        take_picture(console, pictures, Path(f"{cell.trial.name}.png"), cell)
    if given.as_json:
        document = result_document(cell, given.agent, result, status, pictures.written, final)
        out.write(json.dumps(document | {"videos": result.videos}, indent=2) + "\n")
    else:
        show_files(console, result, pictures)


def _session(given: RunArguments, pictures: Pictures, console: Console) -> Session:
    """Return the session of a run, whose events go to a console."""
    progress = RunProgress(console, until=options.until(given.until), verbose=given.verbose)
    page, over, lockstep = given.viewing.page.options(), given.process.over, given.process.lockstep
    rate = options.speed(given.speed or ("max" if page is None and (over is None or lockstep) else "1"))
    served = ServerOptions(
        port=0, lockstep=lockstep, ros1=over == "ros1", ros2=over == "ros2", restart_refusal=AGENT_IN_OWN_PROCESS
    )
    return Session(
        given.cell.target(
            given.files or (),
            console,
            competition=not given.development,
            viewpoints={"--camera": pictures.camera, **given.video.viewpoints()},
            agent=given.agent,
        ),
        rate=rate if page is None else RateControl(rate),
        serve=served if over else False,
        view=page or False,
        record=record_options(given.record, given.video.options(None), given.log, agent=given.agent),
        options=given.run_options(pictures, progress),
        outputs=output.session_outputs(console, partial(progress.line, style="yellow")),
    )


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
    """Warn about a trial without an arm, or a robot of its own. Only a user's own program may have a use for it."""
    joined = joined_name([*files, bundled_sensors()[0]])
    remedy = f"add a file with one, such as: {shlex.join(['cellwright', 'run', joined])}"
    try:
        load_trial(options.paths([joined]))
    except CellwrightError:  # not every text can be continued by another one
        remedy = "add one to the file, such as `arm: {type: ur10}`, and sensors"
    if agent in BUNDLED:
        options.refuse(f"{trial}: the trial has no arm, and agent {agent} requires one; {remedy}")
    output.warn(f"{trial}: the trial has no arm; {remedy}")
