"""Picture of a sweep: the share of points, or the success rate of tasks, against the swept values, as SVG."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from html import escape

from cellwright.config.parsing.expressions import evaluate
from cellwright.running.evaluation.plan.job import LATENCY
from cellwright.running.evaluation.plan.sweep import variant_name
from cellwright.running.evaluation.results.summary import TrialSummary, range_text
from cellwright.util.errors import ExpressionError

STYLE = """
svg.sweep { width: 100%; min-width: 620px; height: auto; margin: 12px 0; }
.curve { fill: none; stroke-width: 2; } .whisker { stroke-width: 2; } .dot { stroke: none; }
.curve.s0, .whisker.s0 { stroke: var(--accent); } .dot.s0 { fill: var(--accent); }
.curve.s1, .whisker.s1 { stroke: var(--held); } .dot.s1 { fill: var(--held); }
.curve.s2, .whisker.s2 { stroke: var(--good); } .dot.s2 { fill: var(--good); }
.curve.s3, .whisker.s3 { stroke: var(--bad); } .dot.s3 { fill: var(--bad); }
"""

_WIDTH, _HEIGHT = 960, 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 40, 14, 50
_MAX_SERIES = 4
_LETTER, _GAP = 6.5, 10.0  # [px] width of a letter at most, and between two labels of the axis
_DODGE = 7.0  # [px] between the marks of two trials at one value
_CAP = 4.0  # [px] half the width of an interval's ends
_LOGARITHMIC_FROM = 50.0  # the largest value over the smallest
_AXES = {LATENCY: "latency [ms]"}
"""Labels of keys whose name alone would not do."""


def sweep_picture(results: Sequence[TrialSummary]) -> str:
    """Return the section with the picture and its legend; empty unless one key alone is swept, by numbers.

    It shows the share of the points, or the success rate if each trial has a task, with 95 % intervals. Trials without
    points to earn have no place in it.
    """
    summaries = [each for each in results if each.share is not None]
    key = _swept_key(summaries)
    series: dict[str, list[tuple[float, TrialSummary]]] = {}
    for each in summaries if key else ():
        number = _number(each.overrides[key])
        if number is None:
            return ""
        series.setdefault(_trial(each), []).append((number, each))
    if not 1 <= len(series) <= _MAX_SERIES:
        return ""
    texts = {number: each.overrides[key] for points in series.values() for number, each in points}
    x = _scale(sorted(texts))
    axis = _AXES.get(key, key)
    quantity = "success rate" if all(each.is_task for each in summaries) else "share of the attainable points"
    parts = [_grid(axis, texts, x)]
    for index, points in enumerate(series.values()):
        parts.append(_curve(points, x, index, (index - (len(series) - 1) / 2) * _DODGE))
    title = f"{quantity} against {axis}"
    label = escape(title)
    picture = (
        f'<svg class="sweep" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{label}">{"".join(parts)}</svg>'
    )
    legend = _legend(list(series), quantity, has_bars=any(each.share_interval for each in summaries))
    heading = escape(title[0].upper() + title[1:])
    return f'<h2>{heading}</h2><div class="card"><div class="scroll">{picture}</div>{legend}</div>'


def _swept_key(summaries: Sequence[TrialSummary]) -> str:
    """Return the only key with several values; empty if there is none, or several, or not in each trial."""
    values: dict[str, set[str]] = {}
    for each in summaries:
        for key, value in each.overrides.items():
            values.setdefault(key, set()).add(value)
    swept = [key for key, found in values.items() if len(found) > 1]
    return swept[0] if len(swept) == 1 and all(swept[0] in each.overrides for each in summaries) else ""


def _trial(summary: TrialSummary) -> str:
    """Return the name of the trial without its overrides."""
    return summary.trial.removesuffix(variant_name("", [f"{key}={value}" for key, value in summary.overrides.items()]))


def _number(text: str) -> float | None:
    try:
        return evaluate(text)
    except ExpressionError:
        return None


def _scale(numbers: Sequence[float]) -> Callable[[float], float]:
    """Return the x [px] of a number; the axis is logarithmic if the numbers are of several orders of magnitude."""
    first, last = numbers[0], numbers[-1]
    # Two values have no shape to show, and zero has no logarithm.
    is_logarithmic = len(numbers) > 2 and first > 0 and last / first >= _LOGARITHMIC_FROM
    place: Callable[[float], float] = math.log if is_logarithmic else float
    width = place(last) - place(first)

    def x(number: float) -> float:
        inner = _WIDTH - _LEFT - _RIGHT
        return _LEFT + inner * (0.04 + 0.92 * ((place(number) - place(first)) / width if width else 0.5))

    return x


def _y(share: float) -> float:
    return _TOP + (_HEIGHT - _TOP - _BOTTOM) * (1.0 - min(1.0, max(0.0, share)))


def _grid(axis: str, texts: Mapping[float, str], x: Callable[[float], float]) -> str:
    parts = []
    for percent in (0, 25, 50, 75, 100):
        y = _y(percent / 100)
        parts.append(
            f'<line class="rule" x1="{_LEFT}" y1="{y:.1f}" x2="{_WIDTH - _RIGHT}" y2="{y:.1f}"/>'
            f'<text x="{_LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{percent} %</text>'
        )
    end = -math.inf
    for number in sorted(texts):
        at, bottom = x(number), _y(0.0)
        parts.append(f'<line class="rule" x1="{at:.1f}" y1="{bottom}" x2="{at:.1f}" y2="{bottom + 5}"/>')
        half = len(texts[number]) * _LETTER / 2
        if at - half >= end + _GAP:
            parts.append(f'<text x="{at:.1f}" y="{bottom + 19}" text-anchor="middle">{escape(texts[number])}</text>')
            end = at + half
    middle = (_LEFT + _WIDTH - _RIGHT) / 2
    parts.append(f'<text class="points" x="{middle}" y="{_HEIGHT - 8}" text-anchor="middle">{escape(axis)}</text>')
    return "".join(parts)


def _curve(points: Sequence[tuple[float, TrialSummary]], x: Callable[[float], float], index: int, shift: float) -> str:
    ordered = sorted(points, key=lambda point: point[0])
    line = " ".join(f"{x(number) + shift:.1f},{_y(each.share or 0.0):.1f}" for number, each in ordered)
    parts = [f'<polyline class="curve s{index}" points="{line}"></polyline>']
    for number, each in ordered:
        at = x(number) + shift
        interval = ""
        if each.share_interval is not None:
            low, high = map(_y, each.share_interval)
            interval = f", 95 %: {range_text(each.share_interval, 100.0, ' %')}"
            parts += [
                f'<line class="whisker s{index}" x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"/>'
                for x1, y1, x2, y2 in (
                    (at, low, at, high),
                    (at - _CAP, low, at + _CAP, low),
                    (at - _CAP, high, at + _CAP, high),
                )
            ]
        runs = f"{each.runs} run{'' if each.runs == 1 else 's'}"
        whole = "of the runs succeeded" if each.is_task else "of the attainable points"
        title = escape(f"{each.trial}: {each.share or 0.0:.1%} {whole}{interval}; {runs}")
        parts.append(
            f'<circle class="dot s{index}" cx="{at:.1f}" cy="{_y(each.share or 0.0):.1f}" r="5">'
            f"<title>{title}</title></circle>"
        )
    return "".join(parts)


def _legend(names: Sequence[str], quantity: str, *, has_bars: bool) -> str:
    """Return the legend; the last entry explains the marks."""
    swatch = '<svg viewBox="0 0 16 12"><rect class="dot s{}" y="4" width="16" height="4"/></svg>'
    marks = [f"<span>{swatch.format(index)}{escape(name)}</span>" for index, name in enumerate(names)]
    words = f"dots: {quantity}{'; bars: 95 % interval' if has_bars else ''}"
    return f'<p class="key">{"".join(marks)}<span>{words}</span></p>'
