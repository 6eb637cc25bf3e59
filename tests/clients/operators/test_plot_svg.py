"""The picture of a test signal: a sound file, with the curves where they belong."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.clients.operators.exercise import Exercise, Shape, Trace, Wave, tracking
from cellwright.clients.operators.plots import WIDTH, tracking_svg

SVG = "{http://www.w3.org/2000/svg}"


def done(joint: str = "elbow", *, height: float = 0.2, samples: int = 300) -> Exercise:
    time = np.linspace(0.0, 3.0, samples)
    told = np.where(time >= 1.0, height, 0.0)
    trace = Trace(joint, time, told, time, np.where(time >= 1.1, height, 0.0))
    return Exercise(Wave(Shape.STEP, 0.2, 0.5, 1), 0.0, trace, tracking(trace, period=2.0, edges=[1.0]))


def points(line: ET.Element) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array([[float(number) for number in pair.split(",")] for pair in line.attrib["points"].split()])


def test_each_joint_has_target_position_and_error() -> None:
    root = ET.fromstring(tracking_svg([done(), done("wrist <3> & co")]))
    lines = root.findall(f"{SVG}polyline")
    assert len(lines) == 6
    told, seen, error = map(points, lines[:3])
    assert told[:, 1].max() - told[:, 1].min() == pytest.approx(200 / 1.1, abs=1.0)  # 5 % of space above and below
    assert seen[seen[:, 1].argmin(), 0] > told[told[:, 1].argmin(), 0]  # the position comes later
    assert error[:, 1].min() > told[:, 1].max()  # and the error stands below
    assert any("wrist <3> & co: step" in (text.text or "") for text in root.findall(f"{SVG}text"))


def test_all_lies_within_the_picture() -> None:
    root = ET.fromstring(tracking_svg([done(), done("wrist")]))
    for line in root.findall(f"{SVG}polyline"):
        x, y = points(line).T
        assert 0 <= x.min() <= x.max() <= WIDTH
        assert 0 <= y.min() <= y.max() <= float(root.attrib["height"])


@pytest.mark.slow
@settings(max_examples=25)
@given(height=st.floats(-1e4, 1e4), samples=st.integers(10, 50))
def test_any_motion_can_be_drawn(height: float, samples: int) -> None:
    ET.fromstring(tracking_svg([done(height=height, samples=samples)]))


def test_a_long_recording_is_thinned() -> None:
    root = ET.fromstring(tracking_svg([done(samples=30_000)]))
    assert all(len(points(line)) < 10_000 for line in root.findall(f"{SVG}polyline"))
