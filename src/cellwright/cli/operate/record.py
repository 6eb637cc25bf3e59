"""Command `cellwright operate record`: the motion of a robot, in a file for `cellwright operate play`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright.cli import options
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.operate.connection import MOTION, NODE, AddressArguments, Node, NodeConnection
from cellwright.cli.output import echo, print_line
from cellwright.cli.parameters import argument, flag, option, with_groups
from cellwright.cli.signals import stopped_by_signals
from cellwright.clients.operators.playback import JointRecorder
from cellwright.clients.operators.robot import JOINT_STATES
from cellwright.engine.loop import StopCondition
from cellwright.util.errors import RunEndedError

APPLIED = "/io_teleop/applied_joint_cmd"
_CHECK_PERIOD = 0.1  # [s] between two checks for a request to stop
_MIN_SLEEP = 0.001  # [s]: less than a step, and more than rounding can produce
_MAX_SILENCE = 2.0  # [s]; the end of a recording without new lines may come this much too late


@with_groups
def record(
    *,
    file: Annotated[Path, argument("FILE", "File to write, .csv or .jsonl.")],
    duration: Annotated[
        float | None, option("T", "Duration [s], from the first message on. Default: until Ctrl-C.", MOTION)
    ] = None,
    targets: Annotated[
        bool, flag("--targets", "Write the targets that the node applies, instead of measured positions.", MOTION)
    ] = False,
    address: AddressArguments,
    node: Node = NODE,
) -> None:
    """Record a robot's joint positions, 100 times a second, for `cellwright operate play`.

    Each line goes to disk at once, so that a failure loses nothing.

        cellwright operate record motion.csv --duration 10

    Exit status: 0 recorded; 1 the node has ended or sent nothing, or the disk is full; 2 bad input.
    """
    suffix = file.suffix.lower() if file.suffix.lower() == ".jsonl" else ".csv"
    path = options.output_file("FILE", file, suffix)
    options.in_range("--duration", duration, options.ABOVE_0, options.LATEST, "a time above 0 s")
    link, console = NodeConnection(address, node), Console(highlight=False)
    failures: list[str] = []
    with link.robot() as robot:
        session, stop = robot.session, StopCondition()
        recorder = JointRecorder(robot, path, topic=APPLIED if targets else JOINT_STATES, report=failures.append)
        length = float("inf") if duration is None else duration
        end = session.time + length + _MAX_SILENCE
        with stopped_by_signals(stop.request):
            try:
                while not stop.is_requested and recorder.is_writing and recorder.time < length and session.time < end:
                    session.sleep(min(_CHECK_PERIOD, max(_MIN_SLEEP, length - recorder.time)))
                recorder.close()
            except RunEndedError as error:
                failures.append(str(error))
    if not recorder.lines and not failures:
        failures.append(f"no messages on {APPLIED if targets else JOINT_STATES}")
    for failure in failures:
        echo(f"error: {failure}", err=True)
    print_line(console, f"{recorder.lines} samples, {recorder.time:.1f} s, in {file}")
    raise typer.Exit(NOT_DONE if failures else DONE)
