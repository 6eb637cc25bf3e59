"""Bars of parts on trays."""

from dataclasses import replace

from matplotlib.figure import Figure

from cellwright.recording.plots.bars import MAX_PARTS, draw_trays, tray_rows
from cellwright.recording.plots.tracks import PlotData, TrackedTrayPart
from tests.recording.plots.plot_data import AGV_1, AGV_2, cell


def drawn(data: PlotData) -> Figure:
    figure = Figure()
    draw_trays(figure.add_subplot(), data)
    return figure


def test_legend_explains_verdicts() -> None:
    (axes,) = drawn(cell()).axes
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["not judged", "right", "faulty", "kit judged"]


def test_empty_tray_has_row() -> None:
    data = replace(cell(), tray_parts=cell().tray_parts[:2])
    assert tray_rows(data) == 3
    (axes,) = drawn(data).axes
    assert [text.get_text() for text in axes.get_yticklabels()] == [AGV_1, AGV_2]


def test_full_tray_shows_first_parts() -> None:
    many = [TrackedTrayPart(AGV_1, f"gear {n}", n / 10, 60.0) for n in range(MAX_PARTS + 5)]
    data = replace(cell(), tray_parts=many)
    assert tray_rows(data) == MAX_PARTS + 1
    (axes,) = drawn(data).axes
    assert f"the first {MAX_PARTS} of {MAX_PARTS + 5}" in axes.get_yticklabels()[0].get_text()
    assert f"gear {MAX_PARTS}" not in {text.get_text() for text in axes.texts}
