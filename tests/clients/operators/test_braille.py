"""Plots in a terminal, dot by dot."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators.plots import Curve, terminal_plot

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
