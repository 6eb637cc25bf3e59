"""`cellwright operate record`: what a robot does, as a file of targets that can be played again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright.cli import options
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.operate.link import NODE, WHAT, Connect, Link, Node, OverRos1
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.clients.operators.recorder import Recorder
from cellwright.clients.operators.robot import JOINT_STATES
from cellwright.util.errors import RunEndedError

_LOOK = 0.1  # [s] between two looks at whether it is to end
_SHORTEST = 0.001  # [s]: less than a tick, and more than rounding makes nothing of
_MAX_SILENCE = 2.0  # [s]; a recording that grows no longer ends so much later than it should have

APPLIED = "/io_teleop/applied_joint_cmd"


def record(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A file that ends in .csv or .jsonl.", show_default=False),
    ],
    duration: Annotated[
        float | None,
        typer.Option(
            metavar="T",
            help="How long [s], from the first message on; until Ctrl-C when left out.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    targets: Annotated[
        bool,
        typer.Option(
            "--targets",
            metavar="",
            help="Write the targets that the node applies, instead of what is measured.",
            rich_help_panel=WHAT,
        ),
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
    path = options.output_file("FILE", file, suffix) or file
    if duration is not None and not 0.0 < duration <= options.LATEST:
        options.refuse(f"--duration {duration:g}: give a time above 0 s")
    link, console = Link(connect, ros1=ros1, node=node), Console(highlight=False)
    failures: list[str] = []
    with link.robot() as robot:
        session, wish = robot.session, Stop()
        recorder = Recorder(robot, path, topic=APPLIED if targets else JOINT_STATES, report=failures.append)
        wanted = float("inf") if duration is None else duration
        end = session.time + wanted + _MAX_SILENCE
        with stopped_by_signals(wish.stop):
            try:
                while not wish.has_come and recorder.is_writing and recorder.time < wanted and session.time < end:
                    session.sleep(min(_LOOK, max(_SHORTEST, wanted - recorder.time)))
                recorder.close()
            except RunEndedError as error:
                failures.append(str(error))
    if not recorder.lines and not failures:
        failures.append(f"nothing came on {APPLIED if targets else JOINT_STATES}")
    for failure in failures:
        typer.echo(f"error: {failure}", err=True)
    console.print(f"{recorder.lines} moments, {recorder.time:.1f} s, in {file}", markup=False, soft_wrap=True)
    raise typer.Exit(NOT_DONE if failures else DONE)
