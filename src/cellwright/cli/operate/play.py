"""Command `cellwright operate play`: the targets of a file, sent to a robot at their times."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from cellwright.cli import options
from cellwright.cli.arguments import AsJson
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.operate.connection import (
    MOTION,
    NODE,
    AddressArguments,
    Node,
    NodeConnection,
    Robot,
    warn_of_unknown,
)
from cellwright.cli.output import echo, print_line
from cellwright.cli.parameters import argument, flag, option, with_groups
from cellwright.cli.signals import stopped_by_signals
from cellwright.clients.operators import playback
from cellwright.clients.operators.playback import Targets, read_targets
from cellwright.clients.operators.robot import OperatedRobot
from cellwright.engine.loop import StopCondition
from cellwright.util.errors import CellwrightError, RunEndedError


@with_groups
def play(
    *,
    file: Annotated[
        Path, argument("FILE", "File of targets: CSV, JSON lines, a ROS 1 bag, or the folder of a ROS 2 bag.")
    ],
    speed: Annotated[float, option("FACTOR", "Seconds of the file per second.", MOTION)] = 1.0,
    approach: Annotated[
        float | None,
        option(
            "T", "Duration of the approach to the first targets [s]. Default: as long as it takes at 0.5 rad/s.", MOTION
        ),
    ] = None,
    loop: Annotated[bool, flag("--loop", "Restart at the end, until Ctrl-C.", MOTION)] = False,
    topic: Annotated[
        str | None,
        option("TOPIC", "For a bag: take this topic's joint states as targets. Default: all its commands.", MOTION),
    ] = None,
    address: AddressArguments,
    robot: Robot = None,
    node: Node = NODE,
    as_json: AsJson = False,
) -> None:
    """Play a file of targets: move slowly to the first of them, then send each at its time.

    A CSV file begins with the line `time,JOINT,JOINT`; times are in seconds, positions in rad or m. An empty field
    leaves its joint out. A line of JSON is `{"time": 0.0, "positions": {"JOINT": 0.1}}`. In both, `gripper_right` and
    `gripper_left` are the closing of a gripper, 0 to 1. From a bag, the io_teleop commands are played, each on its own
    topic.

        cellwright operate record motion.csv --duration 10
        cellwright operate play motion.csv --speed 0.5

        # a recording of another program: measured positions become targets
        cellwright operate play session.bag --topic /io_teleop/joint_states

    Exit status: 0 played, or stopped by Ctrl-C; 1 the robot did not reach the first targets, refused a command, or its
    node has ended; 2 bad input, and nothing was moved.
    """
    options.in_range("--speed", speed, options.ABOVE_0, options.FINITE, "a factor above 0")
    options.in_range("--approach", approach, 0.0, options.LATEST, "a time of at least 0 s")
    targets = _read_any_targets(file, topic)
    link = NodeConnection(address, node, robot)
    console = Console(stderr=as_json, highlight=False)
    failure, rounds = "", 0
    with link.robot() as operated:
        limits = link.limits(operated)
        playback.check(operated, targets, limits)
        warn_of_unknown(limits)
        stop = StopCondition()
        with stopped_by_signals(stop.request):
            try:
                while loop or rounds == 0:
                    _play_once(operated, targets, speed, approach, console, stop)
                    rounds += 1
            except (CellwrightError, RunEndedError) as error:
                failure = str(error)
            except _StopRequestedError:
                pass
    status = NOT_DONE if failure else DONE
    outcome = "failed" if failure else "stopped" if stop.is_requested else "done"
    if failure:
        echo(f"error: {failure}", err=True)
    if as_json:
        document = {
            "file": str(file),
            "moments": len(targets.samples),
            "duration": targets.duration,
            "outcome": outcome,
            "rounds": rounds,
            "messages": operated.sent,
            "error": failure,
            "exit_status": status,
        }
        typer.echo(json.dumps(document, indent=2))
    elif not failure:
        times = f"{rounds} times, " if loop else ""
        print_line(console, f"{outcome}: {times}{operated.sent} messages sent")
    raise typer.Exit(status)


def _read_any_targets(file: Path, topic: str | None) -> Targets:
    from cellwright.clients.operators.bags import is_bag, read_bag  # slow to load

    if is_bag(file):
        return read_bag(file, topic)
    if topic is not None:
        options.refuse("--topic requires a bag")
    return read_targets(file)


def _play_once(
    robot: OperatedRobot, targets: Targets, speed: float, approach: float | None, console: Console, stop: StopCondition
) -> None:
    """Play the targets once."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.1f} s"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("approaching the first targets", total=None)

        def beat(time: float) -> None:
            if stop.is_requested:
                raise _StopRequestedError
            progress.update(task, completed=time)

        playback.approach(robot, targets.first, approach, on_progress=beat)
        progress.update(task, description=str(targets.path), total=targets.duration)
        playback.play(robot, targets, speed=speed, on_progress=beat)


class _StopRequestedError(Exception):
    """The user has requested the end."""
