"""Readers of single values of a layout."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.layout.values import read_colour, read_way
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Items, Leaf, Place, Problems

PLACE = Place(0, "cell.yaml", 1)
READER = Reader(Problems())


def frames(times: list[float]) -> Items:
    """Return key frames at these times."""
    rows = [Items(tuple(Leaf(value, PLACE, "") for value in (time, 1.0, 2.0)), PLACE, "") for time in times]
    return Items(tuple(rows), PLACE, "path")


def test_times_of_key_frames_are_decimal_texts() -> None:
    assert read_way(READER, frames([0, 1.5, 10])) == (("0", 1.0, 2.0), ("1.5", 1.0, 2.0), ("10", 1.0, 2.0))


@given(st.lists(st.floats(0.1, 5.0), min_size=1, max_size=9))
def test_ascending_times_keep_their_value(steps: list[float]) -> None:
    times = [0.0]
    for step in steps:
        times.append(times[-1] + step)
    if all(late - early >= 0.1 for early, late in pairwise(times)):
        found = read_way(READER, frames(times))
        assert found is not None
        assert [float(time) for time, _, _ in found] == times


@pytest.mark.parametrize("times", [[0.0], [1.0, 2.0], [0.0, 2.0, 1.0]])
def test_times_that_do_not_ascend_from_zero_are_refused(times: list[float]) -> None:
    assert read_way(READER, frames(times)) is None


@given(st.integers(0, 0xFFFFFF))
def test_colour_has_its_bytes(value: int) -> None:
    found = read_colour(READER, Leaf(f"#{value:06x}", PLACE, ""))
    assert found is not None
    assert [round(each * 255) for each in found] == [value >> 16, value >> 8 & 255, value & 255, 255]
