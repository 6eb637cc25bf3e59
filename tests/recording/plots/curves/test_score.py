"""Score as stairs, with labels of events."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from cellwright.recording.plots.curves import draw_score
from cellwright.recording.plots.tracks import Mark, PlotData, ScoreTrack
from tests.recording.plots.plot_data import cell


def drawn(data: PlotData, score: ScoreTrack) -> Figure:
    figure = Figure(figsize=(8, 2))
    axes = figure.add_subplot()
    axes.set_xlim(data.begin, data.end)
    draw_score(axes, score, data)
    return figure


def test_score_is_step_curve_to_end() -> None:
    data = cell()
    (axes,) = drawn(data, ScoreTrack(np.array([0.0, 50.0]), np.array([0.0, 8.0]))).axes
    stairs = axes.lines[0]
    assert stairs.get_drawstyle() == "steps-post"
    assert np.asarray(stairs.get_xdata()).tolist() == [0.0, 50.0, 60.0]
    assert np.asarray(stairs.get_ydata()).tolist() == [0.0, 8.0, 8.0]


def test_axis_includes_points_below_zero() -> None:
    (axes,) = drawn(cell(), ScoreTrack(np.array([0.0, 9.0]), np.array([0.0, -3.0]))).axes
    assert axes.get_ylim()[0] <= -3.0


def test_mark_labels_do_not_overlap() -> None:
    marks = [Mark(float(n) / 3, f"order_{n}: something long") for n in range(30)]
    figure = drawn(replace(cell(), marks=marks), ScoreTrack(np.zeros(1), np.zeros(1)))
    (axes,) = figure.axes
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts if text.get_text().startswith("order")]
    assert 2 <= len(boxes) < 30  # every event has a line, and those with room have a label
    assert not any(one.overlaps(other) for n, one in enumerate(boxes) for other in boxes[:n])
    assert sum(len(line.get_xdata()) == 2 for line in axes.lines) >= 30  # type: ignore[arg-type]
