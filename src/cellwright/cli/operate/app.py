"""Commands of `cellwright operate`: call, keyboard, record and play, beside signal."""

from __future__ import annotations

import json
import sys
from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn

from cellwright.cli import options
from cellwright.cli.declarations import argument, flag, option
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.operate.link import (
    NODE,
    RESULT,
    WHAT,
    Connect,
    Node,
    NodeConnection,
    OverRos1,
    Robot,
    warn_of_unknown,
)
from cellwright.cli.operate.signal import signal
from cellwright.cli.output import say
from cellwright.cli.signals import stopped_by_signals
from cellwright.clients.operators import playback
from cellwright.clients.operators.keyboard import Jog, Keyboard
from cellwright.clients.operators.playback import Recorder, Targets, read_targets
from cellwright.clients.operators.robot import JOINT_STATES, Ask, Now, OperatedRobot, ServiceCaller, service_request
from cellwright.clients.operators.terminal import TerminatedError, panel
from cellwright.clients.operators.terminal import keyboard as terminal_keyboard
from cellwright.engine.loop import StopCondition
from cellwright.util.errors import CellwrightError, RunEndedError

_HEARD = 2.0  # [s] that a stop may take to be told of


class Word(StrEnum):
    """What can be said."""

    HOME = "home"
    ENABLE = "enable"
    DISABLE = "disable"
    STOP = "stop"
    CLEAR_STOP = "clear-stop"


def call(
    word: Annotated[
        Word, argument("WORD", "`home`, `enable`, `disable`, `stop` (the emergency stop), or `clear-stop`.")
    ],
    connect: Connect = None,
    ros1: OverRos1 = False,
    node: Node = NODE,
) -> None:
    """Say one word to a robot's node: go home, take commands or none, stop, or end the stop.

    It ends when the node has answered: `home` when the robot is there.

        cellwright operate call home

    Exit status: 0 done; 1 the node refused, or did not answer; 2 bad input.
    """
    link = NodeConnection(connect, ros1=ros1, node=node)
    with link.robot() as robot:
        try:
            if word is Word.STOP:
                robot.send(Now.STOP)
                robot.session.wait_until(lambda: robot.status is not None and robot.status.emergency_stop, _HEARD)
                done = robot.status is None or bool(robot.status.emergency_stop)
                said = "stopped" if done else "sent, and the node does not say that it has stopped"
            else:
                response = robot.session.call(*service_request(Ask[word.name]))
                done, said = bool(response.success), str(response.message)
        except (CellwrightError, RunEndedError) as error:
            done, said = False, str(error)
    typer.echo(f"{word}: {said}" if said else word.value, err=not done)
    raise typer.Exit(DONE if done else NOT_DONE)


def keyboard(connect: Connect = None, ros1: OverRos1 = False, robot: Robot = None, node: Node = NODE) -> None:
    """Drive a robot by the keys of this terminal: joints, tips, grippers, home, enable, emergency stop.

    A key is one step, from where the robot stands; when it is let go nothing is sent any more, and the robot holds. The
    keys are listed on the screen. Joints are moved by /io_teleop/joint_cmd, tips by /io_teleop/target_ee_poses, and
    grippers by /io_teleop/target_gripper_status. The space bar sends /io_teleop/emergency_stop, also while the robot
    goes home; that is software, and replaces no hardware circuit.

        cellwright operate keyboard

        # a robot of your own, with its limits on the screen
        cellwright operate keyboard --robot my_robot/vr_configs.yml

    Exit status: 0 quit with q or Ctrl-C; 1 the node has ended, or the process was asked to; 2 bad input, or no
    terminal.
    """
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        options.refuse(
            "the keyboard operator needs a terminal; without one: cellwright operate play FILE, "
            "or cellwright operate signal JOINT"
        )
    link = NodeConnection(connect, ros1=ros1, node=node, robot=robot)
    console = Console(highlight=False)
    ended = ""
    with link.robot() as there, closing(ServiceCaller(lambda: link.session("_services"))) as services:
        limits = link.limits(there)
        operator = Keyboard(there, Jog(there, limits), services)
        name = link.name(there)
        live = Live(console=console, screen=True, auto_refresh=False)

        def draw() -> None:
            shown = panel(there, operator.jog, limits, name=name, message=operator.message, height=console.size.height)
            live.update(shown, refresh=True)

        try:
            with terminal_keyboard() as read, live:
                operator.run(read, draw)
        except KeyboardInterrupt:
            pass
        except (RunEndedError, TerminatedError) as error:
            ended = str(error)
    if ended:
        typer.echo(f"error: {ended}", err=True)
    say(console, f"{there.sent} messages sent; the robot stays where it was told to go")
    raise typer.Exit(NOT_DONE if ended else DONE)


_LOOK = 0.1  # [s] between two looks at whether it is to end
_SHORTEST = 0.001  # [s]: less than a tick, and more than rounding makes nothing of
_MAX_SILENCE = 2.0  # [s]; a recording that grows no longer ends so much later than it should have

APPLIED = "/io_teleop/applied_joint_cmd"


def record(
    file: Annotated[Path, argument("FILE", "A file that ends in .csv or .jsonl.")],
    duration: Annotated[
        float | None, option("T", "How long [s], from the first message on; until Ctrl-C when left out.", WHAT)
    ] = None,
    targets: Annotated[
        bool, flag("--targets", "Write the targets that the node applies, instead of what is measured.", WHAT)
    ] = False,
    connect: Connect = None,
    ros1: OverRos1 = False,
    node: Node = NODE,
) -> None:
    """Write where a robot's joints are, 100 times a second, for `cellwright operate play`.

    Each line is on disk as soon as it is written, so that nothing is lost when something fails.

        cellwright operate record motion.csv --duration 10

    Exit status: 0 recorded; 1 the node has ended, nothing was told, or the disk is full; 2 bad input.
    """
    suffix = file.suffix.lower() if file.suffix.lower() == ".jsonl" else ".csv"
    path = options.output_file("FILE", file, suffix)
    options.in_range("--duration", duration, options.ABOVE_0, options.LATEST, "a time above 0 s")
    link, console = NodeConnection(connect, ros1=ros1, node=node), Console(highlight=False)
    failures: list[str] = []
    with link.robot() as robot:
        session, wish = robot.session, StopCondition()
        recorder = Recorder(robot, path, topic=APPLIED if targets else JOINT_STATES, report=failures.append)
        wanted = float("inf") if duration is None else duration
        end = session.time + wanted + _MAX_SILENCE
        with stopped_by_signals(wish.request):
            try:
                while not wish.is_requested and recorder.is_writing and recorder.time < wanted and session.time < end:
                    session.sleep(min(_LOOK, max(_SHORTEST, wanted - recorder.time)))
                recorder.close()
            except RunEndedError as error:
                failures.append(str(error))
    if not recorder.lines and not failures:
        failures.append(f"nothing came on {APPLIED if targets else JOINT_STATES}")
    for failure in failures:
        typer.echo(f"error: {failure}", err=True)
    say(console, f"{recorder.lines} moments, {recorder.time:.1f} s, in {file}")
    raise typer.Exit(NOT_DONE if failures else DONE)


class _StopRequestedError(Exception):
    """Somebody wants it to end."""


def play(
    file: Annotated[Path, argument("FILE", "Targets: CSV, JSON lines, a ROS 1 bag, or the folder of a ROS 2 bag.")],
    speed: Annotated[float, option("FACTOR", "Seconds of the file a second.", WHAT)] = 1.0,
    approach: Annotated[
        float | None,
        option(
            "T",
            "How long the way to the first targets takes [s]; as long as it takes at 0.5 rad/s when left out.",
            WHAT,
        ),
    ] = None,
    loop: Annotated[bool, flag("--loop", "Begin again at the end, until Ctrl-C.", WHAT)] = False,
    topic: Annotated[
        str | None,
        option("TOPIC", "Of a bag: take this topic's joint states as targets; all commands in it when left out.", WHAT),
    ] = None,
    connect: Connect = None,
    ros1: OverRos1 = False,
    robot: Robot = None,
    node: Node = NODE,
    as_json: Annotated[bool, flag("--json", "Print what was played as JSON.", RESULT)] = False,
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
    options.in_range("--speed", speed, options.ABOVE_0, options.FINITE, "a factor above 0")
    options.in_range("--approach", approach, 0.0, options.LATEST, "a time from 0 s on")
    targets = _read_any_targets(file, topic)
    link = NodeConnection(connect, ros1=ros1, node=node, robot=robot)
    console = Console(stderr=as_json, highlight=False)
    failure, rounds = "", 0
    with link.robot() as there:
        limits = link.limits(there)
        playback.check(there, targets, limits)
        warn_of_unknown(limits)
        wish = StopCondition()
        with stopped_by_signals(wish.request):
            try:
                while loop or rounds == 0:
                    _play_once(there, targets, speed, approach, console, wish)
                    rounds += 1
            except (CellwrightError, RunEndedError) as error:
                failure = str(error)
            except _StopRequestedError:
                pass
    status = NOT_DONE if failure else DONE
    outcome = "failed" if failure else "stopped" if wish.is_requested else "done"
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
        say(console, f"{outcome}: {times}{there.sent} messages sent")
    raise typer.Exit(status)


def _read_any_targets(file: Path, topic: str | None) -> Targets:
    from cellwright.clients.operators.bags import is_bag, read_bag  # readers of bags take a while to load

    if is_bag(file):
        return read_bag(file, topic)
    if topic is not None:
        options.refuse("--topic: only a bag has topics")
    return read_targets(file)


def _play_once(
    robot: OperatedRobot, targets: Targets, speed: float, slowly: float | None, console: Console, wish: StopCondition
) -> None:
    """Play once."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.1f} s"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("to the first targets", total=None)

        def beat(time: float) -> None:
            if wish.is_requested:
                raise _StopRequestedError
            progress.update(task, completed=time)

        playback.approach(robot, targets.first, slowly, on_beat=beat)
        progress.update(task, description=str(targets.path), total=targets.duration)
        playback.play(robot, targets, speed=speed, on_beat=beat)


app = typer.Typer(
    name="operate",
    help="""Drive a robot's controller node without a headset.

    An operator is a client as any other: it comes over the node's socket or over ROS 1, and speaks on the io_teleop
    topics. Start the node first, in another terminal:

        cellwright teleop qinglong             # the robot
        cellwright operate keyboard            # move it by keys
        cellwright operate signal J_head_yaw   # does the joint follow as it should?
        cellwright operate record motion.csv   # write down what the robot does
        cellwright operate play motion.csv     # and have it do so again
        cellwright operate call home           # one word, for scripts""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
)
app.command()(keyboard)
app.command()(signal)
app.command()(record)
app.command()(play)
app.command()(call)
