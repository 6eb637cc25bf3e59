"""Command `cellwright operate signal`: a test signal for joints, and how well they follow it."""

from __future__ import annotations

import fnmatch
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn
from rich.table import Table

from cellwright.cli import options
from cellwright.cli import output as lines
from cellwright.cli.declarations import flag, option
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
from cellwright.clients.operators.exercise import Exercise, Shape, StepResponse, Wave, check_signal, exercise
from cellwright.clients.operators.plots import Curve, terminal_plot, tracking_svg
from cellwright.clients.operators.robot import OperatedRobot
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError
from cellwright.util.files import write_whole

_PLOT_WIDTH, _PLOT_HEIGHT = 78, 10


def figures_table(exercises: Sequence[Exercise]) -> Table:
    """The figures of all joints, a line each."""
    found = Table(box=None, header_style="bold")
    found.add_column("joint", no_wrap=True)
    has_steps = any(each.tracking.step for each in exercises)
    names = ["RMS", "greatest", "delay"]
    names += ["rise", "settled", "over", "rest"] if has_steps else []
    for name in names:
        found.add_column(name, justify="right", no_wrap=True)
    for each in exercises:
        figures = each.tracking
        row = [each.trace.joint, f"{figures.rms:.4f}", f"{figures.worst:.4f}", _milliseconds(figures.delay)]
        found.add_row(*row, *(_step(figures.step) if has_steps else []))
    return found


def show_plot(console: Console, exercise: Exercise) -> None:
    """Draw what a joint was told and what it did, in the characters of the terminal."""
    trace = exercise.trace
    curves = [
        Curve("target", trace.told_at, trace.told, "yellow"),
        Curve("measured", trace.seen_at, trace.seen, "cyan"),
    ]
    width = min(console.width, _PLOT_WIDTH)
    console.print(terminal_plot(curves, width=width, height=_PLOT_HEIGHT, unit="rad; m"))


def figures_document(exercise: Exercise) -> dict[str, Any]:
    """The figures of one joint as JSON values: rad or m, s, Hz."""
    wave, figures, step = exercise.wave, exercise.tracking, exercise.tracking.step
    return {
        "joint": exercise.trace.joint,
        "wave": wave.shape.value,
        "amplitude": wave.amplitude,
        "frequency": wave.frequency,
        "duration": wave.duration,
        "start": exercise.start,
        "rms_error": figures.rms,
        "max_error": figures.worst,
        "judged_error": figures.judged,
        "delay": figures.delay,
        "state_rate": figures.rate,
        "step": None
        if step is None
        else {"overshoot": step.overshoot, "rise": step.rise, "settling": step.settling, "rest": step.rest},
        "note": exercise.note,
    }


def csv_text(exercises: Sequence[Exercise]) -> str:
    """Every measured position with the target in force: joint, time [s], target, measured, error [rad; m]."""
    lines = ["joint,time,target,measured,error\n"]
    for each in exercises:
        trace = each.trace
        rows = np.column_stack([trace.seen_at, trace.target, trace.seen, trace.target - trace.seen])
        for time, target, seen, error in rows.tolist():
            lines.append(f"{trace.joint},{time:.6f},{target:.9g},{seen:.9g},{error:.9g}\n")
    return "".join(lines)


def _step(step: StepResponse | None) -> list[str]:
    if step is None:
        return ["", "", "", ""]
    overshoot = f"{100 * step.overshoot:.1f} %"
    return [_milliseconds(step.rise), _milliseconds(step.settling), overshoot, f"{step.rest:.4f}"]


def _milliseconds(time: float | None) -> str:
    return "never" if time is None else f"{time * 1e3:.0f} ms"


def signal(
    joints: Annotated[
        list[str],
        typer.Argument(
            metavar="JOINT",
            help="Joints, one after another in this order; `J_arm_r_*` stands for all that match, the last of the "
            "robot first.",
            show_default=False,
        ),
    ],
    wave: Annotated[
        Shape,
        option(
            "`sine` goes to both sides of where the joint stands; `step` and `ramp` go away from there and back.",
            WHAT,
            "SHAPE",
        ),
    ] = Shape.SINE,
    amplitude: Annotated[float, option("How far [rad; m]; below 0, downwards first.", WHAT, "A")] = 0.1,
    frequency: Annotated[float, option("Periods a second [Hz].", WHAT, "F")] = 0.5,
    duration: Annotated[float, option("How long for each joint [s]; made whole periods.", WHAT, "T")] = 4.0,
    connect: Connect = None,
    ros1: OverRos1 = False,
    robot: Robot = None,
    node: Node = NODE,
    max_error: Annotated[
        float | None,
        option(
            "Exit status 1 if the greatest error is larger [rad; m]; of a step: what is left at its end.", RESULT, "E"
        ),
    ] = None,
    max_delay: Annotated[
        float | None, option("Exit status 1 if a joint comes later [ms], or does not follow.", RESULT, "MS")
    ] = None,
    as_json: Annotated[bool, flag("Print the figures as JSON, and nothing else on stdout.", RESULT, "--json")] = False,
    csv: Annotated[Path | None, option("Write every measured position to this file.", RESULT, "FILE.csv")] = None,
    plot: Annotated[Path | None, option("Draw targets, positions and errors.", RESULT, "FILE.svg")] = None,
) -> None:
    """Give joints a test signal, and tell how well they follow it.

    Each joint is told its target 100 times a second by /io_teleop/joint_cmd, about where it stands, and is brought back
    there in the end. Begin with a small amplitude, and with the joints farthest from the body. A joint that follows
    well shows no vibration, no overshoot, and little delay.

        # a tenth of a radian to both sides, twice
        cellwright operate signal J_arm_r_07

        # steps, for all joints of an arm
        cellwright operate signal 'J_arm_r_*' --wave step --amplitude 0.2

        # in CI: fails if a joint is more than 0.05 rad off
        cellwright operate signal J_head_yaw --max-error 0.05 --json

    The target is held against what is measured: error is target minus position; delay is by how much the position has
    to be put forward to be most like the target; rise is from 10 to 90 % of a step; a joint has settled when it stays
    within 5 % of it. Of several steps the worst is told.

    Exit status: 0 done; 1 an error or a delay was larger than allowed, or the node has ended; 2 bad input, and nothing
    was moved.
    """
    wanted = Wave.lasting(wave, amplitude, frequency, duration)
    for name, value in (("--max-error", max_error), ("--max-delay", max_delay)):
        if value is not None and not value >= 0.0:
            options.refuse(f"{name} {value:g}: give a number from 0 on")
    files = (options.output_file("--csv", csv, ".csv"), options.output_file("--plot", plot, ".svg"))
    link = NodeConnection(connect, ros1=ros1, node=node, robot=robot)
    console = Console(stderr=as_json, highlight=False)
    with link.robot() as there:
        chosen = _chosen(there, joints)
        limits = link.limits(there)
        for warning in check_signal(there, chosen, wanted, limits):
            lines.warn(warning)
        warn_of_unknown(limits)
        found, failure = _exercise(there, chosen, wanted, console)
    failures = _failures(found, max_error, max_delay) + ([failure] if failure else [])
    failures += _write(found, *files)
    status = NOT_DONE if failures else DONE
    if as_json:
        document: dict[str, Any] = {"joints": [figures_document(each) for each in found]}
        typer.echo(json.dumps(document | {"failures": failures, "exit_status": status}, indent=2))
    else:
        _show(console, found)
    for line in failures:
        typer.echo(line, err=True)
    raise typer.Exit(status)


def _chosen(robot: OperatedRobot, patterns: Sequence[str]) -> list[str]:
    """The joints that were named, each once."""
    found: list[str] = []
    for pattern in patterns:
        if not any(sign in pattern for sign in "*?["):
            robot.check_names([pattern])
            found.append(pattern)
            continue
        matching = fnmatch.filter(reversed(robot.joints), pattern)
        if not matching:
            raise UnknownNameError("joint", pattern, robot.joints)
        found += matching
    return list(dict.fromkeys(found))


def _exercise(robot: OperatedRobot, joints: Sequence[str], wave: Wave, console: Console) -> tuple[list[Exercise], str]:
    """What came of each joint, and what went wrong if something did; joints after that are left alone."""
    found: list[Exercise] = []
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[at]}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        for number, joint in enumerate(joints, start=1):
            task = progress.add_task(joint, total=1.0, at=f"{number} of {len(joints)}")
            show = partial(_update, progress, task)
            try:
                found.append(exercise(robot, joint, wave, on_beat=show))
            except (CellwrightError, RunEndedError) as error:
                return found, f"{joint}: {error}"
            progress.remove_task(task)
    return found, ""


def _update(progress: Progress, task: TaskID, part: float) -> None:
    progress.update(task, completed=part)


def _failures(found: Sequence[Exercise], max_error: float | None, max_delay: float | None) -> list[str]:
    lines = []
    for each in found:
        figures, joint = each.tracking, each.trace.joint
        if max_error is not None and figures.judged > max_error:
            lines.append(f"{joint}: an error of {figures.judged:.4g}, and {max_error:g} was allowed")
        if max_delay is not None and figures.delay is None:
            lines.append(f"{joint}: it does not follow")
        elif max_delay is not None and figures.delay is not None and figures.delay * 1e3 > max_delay:
            lines.append(f"{joint}: a delay of {figures.delay * 1e3:.0f} ms, and {max_delay:g} ms was allowed")
    return lines


def _write(found: Sequence[Exercise], csv: Path | None, plot: Path | None) -> list[str]:
    """Write the files that were asked for; what could not be written."""
    failures = []
    texts = [(csv, csv_text), (plot if found else None, tracking_svg)]
    for path, text in texts:
        try:
            if path is not None:
                write_whole(path, text(found))
        except OSError as error:  # what was measured is told all the same
            failures.append(f"{path}: cannot be written: {error.strerror or error}")
    return failures


def _show(console: Console, found: Sequence[Exercise]) -> None:
    for each in found:
        console.print(f"{each.trace.joint}: {each.wave.shape} from {round(each.start, 4):g}", markup=False)
        show_plot(console, each)
        console.print()
    if found:
        console.print(figures_table(found))
    for each in found:
        if each.note:
            console.print(f"{each.trace.joint}: {each.note}", markup=False, soft_wrap=True, style="yellow")
