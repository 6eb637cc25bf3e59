"""Drawings in the report of an evaluation, as SVG: the scores of a trial, and the timeline of a run."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from cellwright.running.evaluation.outputs.html import escape

_WIDTH, _LEFT, _RIGHT, _ROW, _BAR = 960, 84, 20, 24, 14
_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
_MAX_BINS = 13


def histogram(values: Sequence[float], best: float) -> str:
    """Return a histogram of the scores as SVG, from 0 to the best [points]."""
    width, height = 132, 34
    bins = min(int(best) + 1, _MAX_BINS) if best >= 1 else 1
    counts = [0] * bins
    for value in values:
        counts[min(bins - 1, max(0, round(value / best * (bins - 1)))) if best > 0 else 0] += 1
    # A bin for each whole number of points as far as a reader can tell them apart.
    top, step = max(counts), width / bins
    bars = []
    for index, count in enumerate(counts):
        tall = max(2.0, count / top * (height - 6)) if count else 0.0
        points = best * index / (bins - 1) if bins > 1 else best
        words = f"{count} x about {points:g} points"
        bars.append(
            f'<rect class="bar" x="{index * step + 0.75:.1f}" y="{height - 1 - tall:.1f}" width="{step - 1.5:.1f}" '
            f'height="{tall:.1f}"><title>{words}</title></rect>'
        )
    label = f"scores from 0 to {best:g} points"
    line = f'<line class="rule" x1="0" y1="{height - 0.5}" x2="{width}" y2="{height - 0.5}"/>'
    return _svg(width, height, label, "".join(bars) + line, "histogram")


def timeline_picture(timeline: Mapping[str, Any]) -> str:
    """Return the timeline of a run as SVG: orders, what the gripper held, AGVs and the kits that they took away."""
    end = max(float(timeline["end"]), 1e-3)
    rows = [*((each["order"], _order(each)) for each in timeline["orders"])]
    rows.append(("gripper", [(held["begin"], held["end"], "held", held["part"]) for held in timeline["held"]]))
    for number, spans in sorted(timeline["agvs"].items()):
        moves = [
            (each["begin"], each["end"], each["state"], each["state"].replace("_", " "))
            for each in spans
            if each["state"] != "ready_to_deliver"
        ]
        rows.append((_station(number), moves))
    height = len(rows) * _ROW + 26
    parts = [_axis(end, len(rows) * _ROW)]
    for index, (name, spans) in enumerate(rows):
        parts.append(_row(index * _ROW, name, spans, end))
    lanes = {name: index for index, (name, _) in enumerate(rows)}
    parts += [_kit_mark(each, lanes.get(_station(each["agv"]), 0) * _ROW, end) for each in timeline["kits"]]
    return _svg(_WIDTH, height, "timeline of the run", "".join(parts), "timeline")


def _station(name: str) -> str:
    """Return the readable name of an AGV, which is a number, or of a fixed tray."""
    return f"AGV {name}" if name.isdecimal() else name


def _order(order: Mapping[str, Any]) -> list[tuple[float, float | None, str, str]]:
    words = f"{order['order']}: announced"
    if order["completed"] is None:
        return [(order["announced"], None, "open", f"{words}, never completed")]
    return [(order["announced"], order["completed"], "order", f"{words} until completed")]


def _x(time: float, end: float) -> float:
    return _LEFT + (_WIDTH - _LEFT - _RIGHT) * min(time, end) / end


def _row(y: int, name: str, spans: Sequence[tuple[float, float | None, str, str]], end: float) -> str:
    middle = y + _ROW / 2
    parts = [
        f'<text class="name" x="{_LEFT - 10}" y="{middle + 4}" text-anchor="end">{escape(name)}</text>',
        f'<rect class="lane" x="{_LEFT}" y="{middle - _BAR / 2}" width="{_WIDTH - _LEFT - _RIGHT}" height="{_BAR}"/>',
    ]
    for begin, stop, kind, words in spans:
        last = end if stop is None else stop
        width = max(1.5, _x(last, end) - _x(begin, end))
        title = f"{escape(words)}, {begin:.1f} s to {last:.1f} s"
        parts.append(
            f'<rect class="{kind}" x="{_x(begin, end):.1f}" y="{middle - _BAR / 2}" width="{width:.1f}" '
            f'height="{_BAR}" rx="2"><title>{title}</title></rect>'
        )
    return "".join(parts)


def _kit_mark(kit: Mapping[str, Any], y: float, end: float) -> str:
    x, middle = _x(kit["time"], end), y + _ROW / 2
    title = f"{escape(kit['kit'])} submitted at {kit['time']:.1f} s: {kit['points']:g} points"
    anchor, shift = ("end", -9) if x > _WIDTH - 120 else ("start", 9)
    return (
        f'<path class="kit" d="M{x:.1f} {middle - 8}l8 8l-8 8l-8 -8z"><title>{title}</title></path>'
        f'<text class="points" x="{x + shift:.1f}" y="{middle + 4}" text-anchor="{anchor}">'
        f"{kit['points']:g} points</text>"
    )


def _axis(end: float, y: float) -> str:
    step = next((each for each in _STEPS if end / each <= 10), math.ceil(end / 10))
    lines = []
    for number in range(int(end / step) + 1):
        time = round(number * step, 3)
        x = _x(time, end)
        lines.append(
            f'<line class="rule" x1="{x:.1f}" y1="0" x2="{x:.1f}" y2="{y + 4}"/>'
            f'<text class="tick" x="{x:.1f}" y="{y + 18}" text-anchor="middle">{time:g} s</text>'
        )
    return "".join(lines)


def _svg(width: int, height: int, label: str, content: str, kind: str) -> str:
    return f'<svg class="{kind}" viewBox="0 0 {width} {height}" role="img" aria-label="{escape(label)}">{content}</svg>'
