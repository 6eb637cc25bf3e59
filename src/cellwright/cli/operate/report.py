"""How joints followed a test signal, as people and programs read it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from cellwright.clients.operators.braille import Curve, plot
from cellwright.clients.operators.exercise import Exercise
from cellwright.clients.operators.tracking import StepResponse

_PLOT_WIDTH, _PLOT_HEIGHT = 78, 10


def table(exercises: Sequence[Exercise]) -> Table:
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
    console.print(plot(curves, width=width, height=_PLOT_HEIGHT, unit="rad; m"))


def document(exercise: Exercise) -> dict[str, Any]:
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
