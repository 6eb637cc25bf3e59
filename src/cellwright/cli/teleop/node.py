"""Run of a robot controller node: its session, its progress and its result."""

import json
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import typer
from rich.console import Console

from cellwright.cli import output
from cellwright.cli.arguments import video_sentence
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.output import echo, progress_bar
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.summary import RunProgress
from cellwright.engine.rate_control import RateControl
from cellwright.robot.node import RobotNode
from cellwright.running.run import RunOptions, ServerOptions, Session, SessionResult, versions
from cellwright.running.run.observers import RobotWindow
from cellwright.running.run.robot_policy import RobotPolicy
from cellwright.running.run.robots import RobotTarget
from cellwright.util.errors import UsageError


def robot_session(
    target: RobotTarget,
    console: Console,
    progress: RunProgress,
    *,
    speed: float | None,
    serve: ServerOptions,
    until: float | None = None,
    window: RobotWindow | None = None,
    **more: Any,
) -> Session:
    """Return a session of a robot controller node that prints its events on a console; `more` are its arguments."""
    return Session(
        target,
        rate=RateControl(speed),
        serve=replace(serve, on_ready=lambda session: output.report_ready(session, target.ready_note())),
        options=RunOptions(until=until, observers=[progress] if window is None else [window, progress]),
        outputs=output.session_outputs(console, progress.notice),
        **more,
    )


def run_robot(
    session: Session,
    console: Console,
    *,
    program: RobotPolicy | None = None,
    window: RobotWindow | None = None,
    as_json: bool = False,
    verbose: bool = False,
) -> int:
    """Run a robot controller node until a signal or its time ends it, and print the result; return the exit status.

    A `program` drives the robot; clients may too.
    """
    with stopped_by_signals(session.stop.request), session:
        result = session.run(program)
    node, snapshot = session.node, None if window is None else window.snapshot
    if not as_json:
        show_node_result(console, node, result, verbose=verbose)
        if program is not None:
            output.print_entry(console, "policy", program.agent.summary)
    if window is not None and snapshot is not None:
        try:
            with progress_bar(console, f"drawing {snapshot}", 1.0) as show:
                # After the summary, since it takes a while.
                window.save(node, show)
        except UsageError as error:
            result = replace(result, error=result.error or str(error))
        else:
            if not as_json:
                output.print_entry(console, "picture", str(snapshot))
    if not as_json:
        output.print_files(console, "video", map(video_sentence, result.videos))
        output.print_files(console, "recording", result.recordings)
    status = NOT_DONE if result.error or not result.is_complete else DONE
    if result.error:
        echo(f"error: {result.error}", err=True)
    if as_json:
        policy = {} if program is None else {"policy": program.agent.summary}
        typer.echo(json.dumps(node_document(node, result, status) | policy, indent=2))
    return status


def robot_progress(console: Console, *, until: float | None) -> RunProgress:
    """Return the progress output of a robot controller node; `until` is the time at which it stops [s], if any."""

    def status(session: Session) -> str:
        node, loop = session.node, session.loop
        pace = "" if loop.rate.speed is None else f"  {loop.pacer.factor:.2f} x real time"
        commands = f"  {node.commander.taken} commands taken, {node.refused} refused, {node.commander.ignored} ignored"
        return f"{node.simulation.time:.1f} s{pace}{commands}"

    return RunProgress(console, until=until, status=status)


def show_node_result(console: Console, node: RobotNode, result: SessionResult, *, verbose: bool) -> None:
    """Print the summary for people."""
    console.print()
    note = partial(output.print_entry, console)
    note("commands", f"{node.commander.taken} taken, {node.refused} refused, {node.commander.ignored} ignored")
    for source, count in sorted(node.bus.refusals.counts.items()):
        note(f"refused {count}", source)
    note("ran" if node.has_driver else "simulated", f"{node.simulation.time:.1f} s in {result.wall:.1f} s")
    if result.pace is not None:
        note("pace", output.pace_text(result.pace))
    if verbose:
        note("state hash", node.simulation.state_hash())
        note("versions", ", ".join(f"{name} {version}" for name, version in versions().items()))


def node_document(node: RobotNode, result: SessionResult, status: int) -> dict[str, Any]:
    """Return the summary as JSON values; times in s."""
    return {
        "robot": node.name,
        "motion": node.settings.motion.value,
        "timestep": float(node.simulation.clock.timestep),
        "outcome": result.outcome,
        "exit_status": status,
        "error": result.error,
        "simulated": node.simulation.time,
        "wall": result.wall,
        "steps": node.simulation.clock.tick,
        "state_hash": node.simulation.state_hash(),
        "commands": {"taken": node.commander.taken, "refused": node.refused, "ignored": node.commander.ignored},
        "refused": dict(node.bus.refusals.counts),
        "unknown_names": list(node.commander.notices.unknown),
        "pace": None if result.pace is None else asdict(result.pace),
        "recordings": [str(path) for path in result.recordings],
        "videos": result.videos,
        "versions": versions(),
    }
