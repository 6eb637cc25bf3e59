"""Path of a tool: from above, and its height."""

import numpy as np
from matplotlib.figure import Figure

from cellwright.recording.plots.charts import draw_from_above, draw_height
from cellwright.recording.plots.tracks import Span, ToolTrack

TIMES = np.linspace(0.0, 10.0, 101)


def path(along: int) -> ToolTrack:
    """Return ten metres along x (0) or y (1), carrying a part from the second to the fifth."""
    at = np.zeros((101, 3))
    at[:, along] = TIMES
    return ToolTrack("cup", "world", TIMES, at, [Span(1.0, 6.0)], [Span(2.0, 5.0)])


def test_view_from_above_has_longer_side_across_and_is_not_mirrored() -> None:
    for along in (0, 1):
        axes = Figure().add_subplot()
        draw_from_above(axes, [path(along)])
        assert axes.get_xlabel() == f"{'xy'[along]} [m] in world"
        assert axes.xaxis_inverted() == (along == 1)  # seen from above, y is to the left of x
        assert not axes.yaxis_inverted()


def test_path_marks_pick_and_release() -> None:
    axes = Figure().add_subplot()
    draw_from_above(axes, [path(0)])
    marks = {str(line.get_marker()): float(np.asarray(line.get_xdata())[0]) for line in axes.lines}
    assert (marks["^"], marks["v"]) == (2.0, 5.0)


def test_part_carried_to_end_has_no_release_mark() -> None:
    axes = Figure().add_subplot()
    track = path(0)
    draw_from_above(axes, [ToolTrack("cup", "world", TIMES, track.positions, (), [Span(2.0, 10.0)])])
    assert "v" not in {line.get_marker() for line in axes.lines}


def test_legend_of_height_names_suction_and_load() -> None:
    axes = Figure().add_subplot()
    draw_height(axes, [path(0)])
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["suction on", "carries a part"]


def test_legend_of_two_tools_has_their_names() -> None:
    axes = Figure().add_subplot()
    tools = [ToolTrack(name, "base", TIMES, path(1).positions) for name in ("right tip", "left tip")]
    draw_height(axes, tools)
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["right tip", "left tip"]
    assert axes.get_title(loc="left") == "Heights of the tools" or axes.get_title() == "Heights of the tools"
