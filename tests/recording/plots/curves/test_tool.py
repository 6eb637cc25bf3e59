"""Path of a tool: from above, and its height."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from cellwright.recording.plots.curves import draw_from_above, draw_height
from cellwright.recording.plots.tracks import CollisionSpan, Span, ToolTrack

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


def test_bars_of_two_cups_stand_above_each_other() -> None:
    axes = Figure().add_subplot()
    draw_height(axes, [replace(path(1), name=name) for name in ("arm1", "arm2")])
    bars = sorted({round(patch.get_y(), 3) for patch in axes.patches if isinstance(patch, Rectangle)})
    assert bars == [0.0, 0.035, 0.08, 0.115]
    assert len({str(line.get_color()) for line in axes.lines}) == 2
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["arm1", "suction on", "carries a part", "arm2"]


def test_legend_of_two_tools_has_their_names() -> None:
    axes = Figure().add_subplot()
    tools = [ToolTrack(name, "base", TIMES, path(1).positions) for name in ("right tip", "left tip")]
    draw_height(axes, tools)
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["right tip", "left tip"]
    assert axes.get_title(loc="left") == "Heights of the tools" or axes.get_title() == "Heights of the tools"


COLLISIONS = (CollisionSpan(3.0, 3.2, "forearm / bin8"), CollisionSpan(7.0, 9.0, "wrist 2 / camera frame 2"))


def test_collisions_are_shaded_named_and_in_legend_of_height() -> None:
    axes = Figure().add_subplot()
    axes.set_xlim(0.0, 10.0)
    draw_height(axes, [path(0)], COLLISIONS)
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["suction on", "carries a part", "collision"]
    (crosses,) = [line for line in axes.lines if line.get_marker() == "x"]
    assert np.asarray(crosses.get_xdata()).tolist() == [3.0, 7.0]
    grey = [patch.get_extents() for patch in axes.patches if patch.get_alpha()]
    shaded = [axes.transData.inverted().transform(box.get_points())[:, 0].tolist() for box in grey]
    assert shaded == [pytest.approx([3.0, 3.2]), pytest.approx([7.0, 9.0])]
    assert {text.get_text() for text in axes.texts} >= {each.label for each in COLLISIONS}


def test_view_from_above_marks_tool_where_collisions_began() -> None:
    axes = Figure().add_subplot()
    draw_from_above(axes, [path(0)], COLLISIONS)
    assert [float(np.asarray(line.get_xdata())[0]) for line in axes.lines if line.get_marker() == "X"] == [3.0, 7.0]


def test_view_from_above_marks_the_tool_of_the_arm_that_collided_and_none_for_a_robot() -> None:
    axes = Figure().add_subplot()
    tools = [replace(path(along), arm=arm) for along, arm in enumerate(("arm1", "arm2"))]
    owners = ("arm2", "qinglong", "arm1")
    draw_from_above(axes, tools, [CollisionSpan(3.0 + n, 4.0 + n, owner=owner) for n, owner in enumerate(owners)])
    crosses = [np.asarray(line.get_data())[:, 0].tolist() for line in axes.lines if line.get_marker() == "X"]
    assert sorted(crosses) == [[0.0, 3.0], [5.0, 0.0]]


def test_without_collisions_nothing_is_marked() -> None:
    axes = Figure().add_subplot()
    draw_height(axes, [path(0)])
    draw_from_above(axes, [path(0)])
    assert not {"x", "X"} & {line.get_marker() for line in axes.lines}
