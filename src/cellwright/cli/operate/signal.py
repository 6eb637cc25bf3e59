"""Command `cellwright operate signal`: a test signal to joints, and how well they follow it."""

import fnmatch
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from cellwright.cli import options
from cellwright.cli.arguments import OUTPUT, AsJson
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
from cellwright.cli.output import echo, print_line, warn, write_result
from cellwright.cli.parameters import argument, option, with_groups
from cellwright.cli.tables import FOLD, RIGHT, FittedTable, print_table, table
from cellwright.clients.operators import playback
from cellwright.clients.operators.exercise import Exercise, JointStepResponse, Wave, WaveShape, check_signal, exercise
from cellwright.clients.operators.plots import Curve, terminal_plot, tracking_svg
from cellwright.clients.operators.robot import JointLimits, OperatedRobot
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError, UsageError

_PLOT_WIDTH, _PLOT_HEIGHT = 78, 10


@with_groups
def signal(
    *,
    joints: Annotated[
        list[str],
        argument(
            "JOINT",
            "Joints, moved one after another in this order; `J_arm_r_*` means all that match except mimic joints, the "
            "robot's last one first.",
        ),
    ],
    wave: Annotated[
        WaveShape,
        option(
            "SHAPE",
            "`sine` swings to both sides of the joint's position; `step` and `ramp` move away from it and back.",
            MOTION,
        ),
    ] = WaveShape.SINE,
    amplitude: Annotated[float, option("A", "Amplitude [rad; m]; below 0, downwards first.", MOTION)] = 0.1,
    frequency: Annotated[float, option("F", "Frequency [Hz].", MOTION)] = 0.5,
    duration: Annotated[float, option("T", "Duration for each joint [s]; rounded to whole periods.", MOTION)] = 4.0,
    address: AddressArguments,
    robot: Robot = None,
    node: Node = NODE,
    max_error: Annotated[
        float | None,
        option(
            "E", "Exit with status 1 if the maximum error is larger [rad; m]; for a step, the error at its end.", OUTPUT
        ),
    ] = None,
    max_delay: Annotated[
        float | None,
        option("MS", "Exit with status 1 if a joint's delay is larger [ms], or it does not follow.", OUTPUT),
    ] = None,
    as_json: AsJson = False,
    csv: Annotated[Path | None, option("FILE.csv", "Write every measured position to this file.", OUTPUT)] = None,
    plot: Annotated[Path | None, option("FILE.svg", "Plot targets, positions and errors to this file.", OUTPUT)] = None,
) -> None:
    """Send a test signal to joints, and measure how well they follow it.

    Each joint gets a target on /io_teleop/joint_cmd 100 times a second, around its present position, and returns there
    at the end. Begin with a small amplitude, and with the joints farthest from the body. A joint that follows well
    shows no vibration, no overshoot, and little delay.

        # a tenth of a radian to both sides, twice
        cellwright operate signal J_arm_r_07

        # steps, for all joints of an arm
        cellwright operate signal 'J_arm_r_*' --wave step --amplitude 0.2

        # in CI: fails if a joint is more than 0.05 rad off
        cellwright operate signal J_head_yaw --max-error 0.05 --json

    Error is target minus measured position. Delay is the time shift at which the position matches the target best. Rise
    is from 10 to 90 % of a step. Settling ends when the joint stays within 5 % of the step. Of several steps the worst
    counts.

    Exit status: 0 done; 1 an error or a delay was larger than allowed, or the node has ended; 2 bad input, and nothing
    was moved.
    """
    full_wave = Wave.lasting(wave, amplitude, frequency, duration)
    options.in_range("--max-error", max_error, 0.0, math.inf, "a number of at least 0")
    options.in_range("--max-delay", max_delay, 0.0, math.inf, "a number of at least 0")
    options.output_file("--csv", csv, ".csv")
    options.output_file("--plot", plot, ".svg")
    link = NodeConnection(address, node, robot)
    console = Console(stderr=as_json, highlight=False)
    with link.robot() as operated:
        limits = link.limits(operated)
        chosen = _chosen(operated, joints, limits)
        for warning in check_signal(operated, chosen, full_wave, limits):
            warn(warning)
        warn_of_unknown(limits)
        exercises, failure = _exercise(operated, chosen, full_wave, console)
    failures = _failures(exercises, max_error, max_delay) + ([failure] if failure else [])
    if csv is not None:
        failures += write_result(csv, csv_text(exercises))
    if plot is not None and exercises:
        failures += write_result(plot, tracking_svg(exercises))
    status = NOT_DONE if failures else DONE
    if as_json:
        document: dict[str, Any] = {"joints": [figures_document(each) for each in exercises]}
        typer.echo(json.dumps(document | {"failures": failures, "exit_status": status}, indent=2))
    else:
        _show(console, exercises)
    for line in failures:
        echo(line, err=True)
    raise typer.Exit(status)


def _chosen(robot: OperatedRobot, patterns: Sequence[str], limits: JointLimits) -> list[str]:
    """Return the joints that match the patterns, each once; a wildcard matches no mimic joint beside other joints."""
    chosen: list[str] = []
    for pattern in patterns:
        if not any(sign in pattern for sign in "*?["):
            if pattern in playback.GRIPPERS and pattern not in robot.joints:
                raise UsageError(
                    f"{pattern} is a gripper, not a joint; move it with cellwright operate play, from a file with "
                    f"the columns {', '.join(playback.GRIPPERS)}"
                )
            robot.check_names([pattern])
            chosen.append(pattern)
            continue
        matching = fnmatch.filter(reversed(robot.joints), pattern)
        if not matching:
            raise UnknownNameError("joint", pattern, robot.joints)
        chosen += [name for name in matching if name not in limits.leaders] or matching
    return list(dict.fromkeys(chosen))


def _exercise(robot: OperatedRobot, joints: Sequence[str], wave: Wave, console: Console) -> tuple[list[Exercise], str]:
    """Return the exercise of each joint, and the error if there was one; joints after that do not move."""
    exercises: list[Exercise] = []
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[at]}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=1.0, at="")

        def show(part: float) -> None:
            progress.update(task, completed=part)

        for number, joint in enumerate(joints, start=1):
            progress.reset(task, description=joint, at=f"{number} of {len(joints)}")
            try:
                exercises.append(exercise(robot, joint, wave, on_progress=show))
            except (CellwrightError, RunEndedError) as error:
                return exercises, f"{joint}: {error}"
    return exercises, ""


def _failures(exercises: Sequence[Exercise], max_error: float | None, max_delay: float | None) -> list[str]:
    lines = []
    for each in exercises:
        figures, joint = each.tracking, each.trace.joint
        if max_error is not None and figures.judged > max_error:
            lines.append(f"{joint}: error {figures.judged:.4g} exceeds --max-error {max_error:g}")
        if max_delay is not None and figures.delay is None:
            lines.append(f"{joint}: does not follow its target")
        elif max_delay is not None and figures.delay is not None and figures.delay * 1e3 > max_delay:
            lines.append(f"{joint}: delay {figures.delay * 1e3:.0f} ms exceeds --max-delay {max_delay:g}")
    return lines


def _show(console: Console, exercises: Sequence[Exercise]) -> None:
    for each in exercises:
        print_line(console, f"{each.trace.joint}: {each.wave.shape} from {round(each.start, 4):g}")
        show_plot(console, each)
        console.print()
    if exercises:
        print_table(console, figures_table(exercises))
    for each in exercises:
        if each.note:
            print_line(console, f"{each.trace.joint}: {each.note}", "yellow")


def figures_table(exercises: Sequence[Exercise]) -> FittedTable:
    """Return a table of the figures of all joints, a line each."""
    has_steps = any(each.tracking.step for each in exercises)
    headings = ["RMS", "max", "delay", *(["rise", "settling", "overshoot", "rest"] if has_steps else [])]
    rows = []
    for each in exercises:
        figures = each.tracking
        row = [each.trace.joint, f"{figures.rms:.4f}", f"{figures.worst:.4f}", _milliseconds(figures.delay)]
        rows.append([*row, *(_step(figures.step) if has_steps else [])])
    columns = {"joint": FOLD, **dict.fromkeys(headings, RIGHT)}
    return table(columns, rows, box=None, header_style="bold", show_edge=True, pad_edge=True)


def show_plot(console: Console, exercise: Exercise) -> None:
    """Draw a joint's targets and its motion in the characters of the terminal."""
    trace = exercise.trace
    curves = [
        Curve("target", trace.target_times, trace.targets, "yellow"),
        Curve("measured", trace.measured_times, trace.measured, "cyan"),
    ]
    width = min(console.width, _PLOT_WIDTH)
    console.print(terminal_plot(curves, width=width, height=_PLOT_HEIGHT, unit="rad; m"))


def figures_document(exercise: Exercise) -> dict[str, Any]:
    """Return the figures of one joint as JSON values: rad or m, s, Hz."""
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
    """Return every measured position with its target: joint, time [s], target, measured, error [rad; m]."""
    lines = ["joint,time,target,measured,error\n"]
    for each in exercises:
        trace = each.trace
        rows = np.column_stack(
            [trace.measured_times, trace.target_in_force, trace.measured, trace.target_in_force - trace.measured]
        )
        for time, target, seen, error in rows.tolist():
            lines.append(f"{trace.joint},{time:.6f},{target:.9g},{seen:.9g},{error:.9g}\n")
    return "".join(lines)


def _step(step: JointStepResponse | None) -> list[str]:
    if step is None:
        return ["", "", "", ""]
    overshoot = f"{100 * step.overshoot:.1f} %"
    return [_milliseconds(step.rise), _milliseconds(step.settling), overshoot, f"{step.rest:.4f}"]


def _milliseconds(time: float | None) -> str:
    return "never" if time is None else f"{time * 1e3:.0f} ms"
