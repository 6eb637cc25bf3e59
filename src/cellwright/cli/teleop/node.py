"""Controller node of a robot, run from the command line: its progress and its summary."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import partial
from typing import Any

import typer
from rich.console import Console

from cellwright.cli import arguments, output
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.output import progress_bar
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.summary import RunProgress
from cellwright.engine.rate_control import RateControl
from cellwright.robot.node import RobotNode
from cellwright.running.run import Session, SessionResult, versions
from cellwright.running.run.robots import RobotTarget, RobotWindow
from cellwright.util.errors import UsageError


def robot_progress(console: Console, *, until: float | None) -> RunProgress:
    """What tells on a console how a robot's node goes; `until` is when it is to stop [s], if ever."""

    def status(session: Session) -> str:
        node, loop = session.node, session.loop
        pace = "" if loop.rate.speed is None else f"  {loop.pacer.factor:.2f} x real time"
        commands = f"  {node.commander.taken} commands taken, {node.refused} refused, {node.commander.ignored} ignored"
        return f"{node.simulation.time:.1f} s{pace}{commands}"

    return RunProgress(console, until=until, status=status)


def show_node_result(console: Console, node: RobotNode, ran: SessionResult, *, verbose: bool) -> None:
    """Tell people what came of it."""
    console.print()
    note = partial(output.note, console)
    note("commands", f"{node.commander.taken} taken, {node.refused} refused, {node.commander.ignored} ignored")
    for source, count in sorted(node.bus.refusals.counts.items()):
        note(f"refused {count}", source)
    note("ran" if node.made_with["driver"] else "simulated", f"{node.simulation.time:.1f} s in {ran.wall:.1f} s")
    if ran.pace is not None:
        note("pace", output.pace_text(ran.pace))
    if verbose:
        note("state hash", node.simulation.state_hash())
        note("versions", ", ".join(f"{name} {version}" for name, version in versions().items()))


def node_document(node: RobotNode, ran: SessionResult, status: int) -> dict[str, Any]:
    """The summary as JSON values; times in s."""
    return {
        "robot": node.name,
        "motion": node.made_with["motion"],
        "timestep": float(node.simulation.clock.timestep),
        "outcome": ran.outcome,
        "exit_status": status,
        "error": ran.error,
        "simulated": node.simulation.time,
        "wall": ran.wall,
        "steps": node.simulation.clock.tick,
        "state_hash": node.simulation.state_hash(),
        "commands": {"taken": node.commander.taken, "refused": node.refused, "ignored": node.commander.ignored},
        "refused": dict(node.bus.refusals.counts),
        "unknown_names": list(node.commander.notices.unknown),
        "pace": None if ran.pace is None else asdict(ran.pace),
        "recordings": [str(path) for path in ran.recordings],
        "videos": ran.videos,
        "versions": versions(),
    }


def robot_session(
    target: RobotTarget,
    console: Console,
    progress: RunProgress,
    *,
    speed: float | None,
    window: RobotWindow | None = None,
    **more: Any,
) -> Session:
    """A session that runs a robot's node, and says on a console what happens; `more` as `Session` takes it."""
    return Session(
        target,
        rate=RateControl(speed),
        observers=[progress] if window is None else [window, progress],
        on_ready=output.say_ready,
        **output.words_for(console, progress.notice),
        **more,
    )


def run_robot(
    session: Session,
    console: Console,
    *,
    window: RobotWindow | None = None,
    as_json: bool = False,
    verbose: bool = False,
) -> int:
    """Run a robot's node until a signal ends it or its time is over, and print what came of it.

    Args:
        session: made by `robot_session`.
        console: where people read.
        window: what somebody wants to see of it.
        as_json: print the summary as JSON, and nothing else on stdout.
        verbose: say more in the summary.

    Returns:
        The exit status.
    """
    with stopped_by_signals(session.stop.request), session:
        ran = session.run()
    node, snapshot = session.node, None if window is None else window.snapshot
    if not as_json:
        show_node_result(console, node, ran, verbose=verbose)
    if window is not None and snapshot is not None:
        try:
            with progress_bar(console, f"drawing {snapshot}", 1.0) as tell:
                window.save(node, tell)  # after the summary, since it takes a while
        except UsageError as error:
            ran.error = ran.error or str(error)
        else:
            if not as_json:
                output.note(console, "picture", str(snapshot))
    if not as_json:
        output.note_files(console, "video", map(arguments.video_sentence, ran.videos))
        output.note_files(console, "recording", ran.recordings)
    status = NOT_DONE if ran.error or not ran.is_complete else DONE
    if ran.error:
        typer.echo(f"error: {ran.error}", err=True)
    if as_json:
        typer.echo(json.dumps(node_document(node, ran, status), indent=2))
    return status
