"""Names beside curves do not overlap."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from cellwright.recording.plots.style import SIZE_OF_NAMES, name_at_the_end


@pytest.mark.slow
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_names_at_end_do_not_overlap_and_keep_order(values: list[float]) -> None:
    figure = Figure(figsize=(6, 3), dpi=100)
    axes = figure.add_subplot()
    axes.set_ylim(0.0, 1.0)
    name_at_the_end(axes, [(f"{number}", value, "black") for number, value in enumerate(values)])
    placed = [(text.xy[1], values[int(text.get_text())]) for text in axes.texts]  # type: ignore[attr-defined]
    heights = sorted(height for height, _ in placed)
    pixels = axes.get_window_extent().height
    apart = [(upper - lower) * pixels for lower, upper in pairwise(heights)]
    assert all(gap > SIZE_OF_NAMES * 100 / 72 for gap in apart)
    assert [value for _, value in sorted(placed)] == sorted(values)
