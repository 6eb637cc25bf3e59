"""Tests of the plots of a joint that follows its target."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.clients.operators.exercise import Exercise, Trace, Wave, WaveShape, tracking
from cellwright.clients.operators.plots import Curve, terminal_plot, tracking_svg

SVG = "{http://www.w3.org/2000/svg}"


def done(joint: str = "elbow", *, height: float = 0.2, samples: int = 300) -> Exercise:
    time = np.linspace(0.0, 3.0, samples)
    target = np.where(time >= 1.0, height, 0.0)
    trace = Trace(joint, time, target, time, np.where(time >= 1.1, height, 0.0))
    return Exercise(Wave(WaveShape.STEP, 0.2, 0.5, 1), 0.0, trace, tracking(trace, period=2.0, edges=[1.0]))


def curves(svg: str) -> list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    """Return the points of each curve; samples in the legend are not cut off at a frame."""
    paths = [path for path in ET.fromstring(svg).iter(f"{SVG}path") if "clip-path" in path.attrib]
    drawn = [path.attrib["d"] for path in paths if "fill: none; stroke: #" in path.attrib["style"]]
    lines = [line for line in drawn if line.count("L") > 1]  # one stroke is a line of the grid
    return [np.array(re.findall(r"[ML] (\S+) (\S+)", line), dtype=float) for line in lines]


def test_svg_has_target_position_and_error_of_each_joint() -> None:
    svg = tracking_svg([done(), done("wrist <3> & $co$")])
    found = curves(svg)
    assert len(found) == 6
    target, seen, error = found[:3]
    assert np.ptp(target[:, 1]) == pytest.approx(np.ptp(seen[:, 1]))
    assert seen[seen[:, 1].argmin(), 0] > target[target[:, 1].argmin(), 0]  # the position comes later
    assert error[:, 1].min() > target[:, 1].max()  # and the error stands below
    assert any("wrist <3> & $co$: step" in (text.text or "") for text in ET.fromstring(svg).iter(f"{SVG}text"))


def test_svg_curves_lie_within_picture() -> None:
    svg = tracking_svg([done(), done("wrist")])
    _, _, width, height = map(float, ET.fromstring(svg).attrib["viewBox"].split())
    for curve in curves(svg):
        x, y = curve.T
        assert 0 <= x.min() <= x.max() <= width
        assert 0 <= y.min() <= y.max() <= height


def test_svg_of_same_signal_is_identical() -> None:
    assert tracking_svg([done()]) == tracking_svg([done()])


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(height=st.floats(-1e4, 1e4), samples=st.integers(10, 50))
def test_svg_of_any_motion_is_valid(height: float, samples: int) -> None:
    ET.fromstring(tracking_svg([done("手\x1b\ud800", height=height, samples=samples)]))


def test_svg_of_long_recording_is_thinned() -> None:
    exercise = done(samples=30_000)
    noise = np.random.default_rng(1).normal(size=30_000)
    trace = Trace("elbow", exercise.trace.target_times, noise, exercise.trace.measured_times, noise)
    svg = tracking_svg([replace(exercise, trace=trace)])
    assert all(len(points) < 10_000 for points in curves(svg))


TIME = np.linspace(0.0, 2.0, 50)


def frame(text: str) -> list[str]:
    """Return the lines of the frame, without the axis labels before it."""
    return [line.split("┤" if "┤" in line else "│", 1)[1] for line in text.splitlines() if "┤" in line or "│" in line]


def test_rising_curve_runs_from_lower_left_to_upper_right() -> None:
    lines = frame(terminal_plot([Curve("target", TIME, TIME, "red")], width=20, height=5).plain)
    assert len(lines) == 5
    assert lines[0][-1] != "\u2800"
    assert lines[-1][0] != "\u2800"
    assert lines[0][0] == lines[-1][-1] == "\u2800"
    columns = [max(i for i, sign in enumerate(line) if sign != "\u2800") for line in lines]
    assert columns == sorted(columns, reverse=True)


def test_plot_labels_axis_ends_and_curves() -> None:
    text = terminal_plot(
        [Curve("target", TIME, TIME - 1.0, "red"), Curve("measured", TIME, 0 * TIME + 1e-20, "blue")],
        width=40,
        unit="rad",
    ).plain
    assert text.splitlines()[0].startswith(" 1┤")
    assert "-1┤" in text
    assert text.splitlines()[-2].split() == ["0", "s", "2", "s"]
    assert text.splitlines()[-1].strip() == "━ target  ━ measured [rad]"


def test_overlapping_curves_show_colour_of_later_one() -> None:
    text = terminal_plot(
        [Curve("target", TIME, TIME, "red"), Curve("measured", TIME, TIME, "blue")], width=20, height=5
    )
    colours = {str(span.style) for span in text.spans if text.plain[span.start : span.end].strip("\u2800 ━") != ""}
    assert "blue" in colours
    assert "red" not in colours


@given(
    values=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40), width=st.integers(1, 100), height=st.integers(1, 20)
)
def test_plot_has_requested_size(values: list[float], width: int, height: int) -> None:
    time = np.arange(float(len(values)))
    lines = frame(terminal_plot([Curve("x", time, np.array(values), "red")], width=width, height=height).plain)
    assert len(lines) == height
    assert len({len(line) for line in lines}) == 1
    assert any(sign != "\u2800" for line in lines for sign in line)
