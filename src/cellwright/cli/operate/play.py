"""`cellwright operate play`: a file of targets, said to a robot in its time."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from cellwright.cli import options
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.operate.link import NODE, RESULT, WHAT, Connect, Link, Node, OverRos1, Robot, warn_of_unknown
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.clients.operators import playback
from cellwright.clients.operators.robot import OperatedRobot
from cellwright.clients.operators.target_files import Targets, read_targets
from cellwright.util.errors import CellwrightError, RunEndedError


class _StoppedError(Exception):
    """Somebody wants it to end."""


def play(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Targets: CSV, JSON lines, a ROS 1 bag, or the folder of a ROS 2 bag.",
            show_default=False,
        ),
    ],
    speed: Annotated[
        float, typer.Option(metavar="FACTOR", help="Seconds of the file a second.", rich_help_panel=WHAT)
    ] = 1.0,
    approach: Annotated[
        float | None,
        typer.Option(
            metavar="T",
            help="How long the way to the first targets takes [s]; as long as it takes at 0.5 rad/s when left out.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    loop: Annotated[
        bool, typer.Option("--loop", metavar="", help="Begin again at the end, until Ctrl-C.", rich_help_panel=WHAT)
    ] = False,
    topic: Annotated[
        str | None,
        typer.Option(
            metavar="TOPIC",
            help="Of a bag: take this topic's joint states as targets; all commands in it when left out.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    connect: Connect = None,
    ros1: OverRos1 = False,
    robot: Robot = None,
    node: Node = NODE,
    as_json: Annotated[
        bool, typer.Option("--json", metavar="", help="Print what was played as JSON.", rich_help_panel=RESULT)
    ] = False,
) -> None:
    """Play a file of targets: move slowly to the first of them, then say each in its time.

    A CSV file begins with the line `time,JOINT,JOINT`; times are in seconds, positions in rad or m, and an empty field
    says nothing about its joint. A line of JSON is `{"time": 0.0, "positions": {"JOINT": 0.1}}`. In both,
    `gripper_right` and `gripper_left` are how far a gripper is closed, 0 to 1. Of a bag its io_teleop commands are
    played, each on its own topic.

        cellwright operate record motion.csv --duration 10
        cellwright operate play motion.csv --speed 0.5

        # a recording of somebody else's: what was measured becomes the target
        cellwright operate play session.bag --topic /io_teleop/joint_states

    Exit status: 0 played, or stopped by Ctrl-C; 1 the robot did not come to the first targets, refused a command, or is
    gone; 2 bad input, and nothing was moved.
    """
    if not 0.0 < speed < math.inf:
        options.refuse(f"--speed {speed:g}: give a factor above 0")
    if approach is not None and not 0.0 <= approach <= options.LATEST:
        options.refuse(f"--approach {approach:g}: give a time from 0 s on")
    targets = _read(file, topic)
    link = Link(connect, ros1=ros1, node=node, robot=robot)
    console = Console(stderr=as_json, highlight=False)
    failure, rounds = "", 0
    with link.robot() as there:
        limits = link.limits(there)
        playback.check(there, targets, limits)
        warn_of_unknown(limits)
        wish = Stop()
        with stopped_by_signals(wish.stop):
            try:
                while loop or rounds == 0:
                    _play(there, targets, speed, approach, console, wish)
                    rounds += 1
            except (CellwrightError, RunEndedError) as error:
                failure = str(error)
            except _StoppedError:
                pass
    status = NOT_DONE if failure else DONE
    outcome = "failed" if failure else "stopped" if wish.has_come else "done"
    if failure:
        typer.echo(f"error: {failure}", err=True)
    if as_json:
        document = {
            "file": str(file),
            "moments": len(targets.moments),
            "duration": targets.duration,
            "outcome": outcome,
            "rounds": rounds,
            "messages": there.sent,
            "error": failure,
            "exit_status": status,
        }
        typer.echo(json.dumps(document, indent=2))
    elif not failure:
        times = f"{rounds} times, " if loop else ""
        console.print(f"{outcome}: {times}{there.sent} messages sent", markup=False, soft_wrap=True)
    raise typer.Exit(status)


def _read(file: Path, topic: str | None) -> Targets:
    from cellwright.clients.operators.bags import is_bag, read_bag  # readers of bags take a while to load

    if is_bag(file):
        return read_bag(file, topic)
    if topic is not None:
        options.refuse("--topic: only a bag has topics")
    return read_targets(file)


def _play(
    robot: OperatedRobot, targets: Targets, speed: float, slowly: float | None, console: Console, wish: Stop
) -> None:
    """Play once."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.1f} s"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("to the first targets", total=None)

        def beat(time: float) -> None:
            if wish.has_come:
                raise _StoppedError
            progress.update(task, completed=time)

        playback.approach(robot, targets.first, slowly, on_beat=beat)
        progress.update(task, description=str(targets.path), total=targets.duration)
        playback.play(robot, targets, speed=speed, on_beat=beat)
