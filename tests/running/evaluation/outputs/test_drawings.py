"""Tests of the small pictures in the report."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.outputs.drawings import histogram, timeline_picture
from tests.running.evaluation.made_results import TIMELINE


def shapes(picture: str, tag: str, kind: str) -> list[ElementTree.Element]:
    return [each for each in ElementTree.fromstring(picture).iter(tag) if each.get("class") == kind]


def number(shape: ElementTree.Element, key: str) -> float:
    return float(shape.get(key, "nan"))


@pytest.mark.slow
@given(values=st.lists(st.floats(min_value=0, max_value=30), min_size=1, max_size=40), best=st.sampled_from([0, 3, 30]))
def test_histogram_counts_every_value(values: list[float], best: float) -> None:
    bars = shapes(histogram(values, best), "rect", "bar")
    counts = [int((bar.findtext("title") or "").split()[0]) for bar in bars]
    assert sum(counts) == len(values)
    assert all((number(bar, "height") > 0.0) == (count > 0) for bar, count in zip(bars, counts, strict=True))


def test_histogram_bars_stand_at_scores() -> None:
    bars = shapes(histogram([0.0, 12.0, 12.0], 12.0), "rect", "bar")
    assert len(bars) == 13
    assert [bar.findtext("title") for bar in (bars[0], bars[-1])] == ["1 x about 0 points", "2 x about 12 points"]
    assert number(bars[-1], "height") == pytest.approx(2 * number(bars[0], "height"))


def test_timeline_marks_stand_at_their_times() -> None:
    picture = timeline_picture(TIMELINE)
    (order,), (still_open,) = shapes(picture, "rect", "order"), shapes(picture, "rect", "open")
    (held,), (delivering,) = shapes(picture, "rect", "held"), shapes(picture, "rect", "delivering")
    second = number(order, "width") / 15.0
    assert number(still_open, "x") == pytest.approx(number(order, "x") + 5.0 * second, abs=0.2)
    assert number(still_open, "width") == pytest.approx(15.0 * second, abs=0.2)
    assert number(held, "x") == pytest.approx(number(order, "x") + 2.0 * second, abs=0.2)
    assert number(delivering, "x") + number(delivering, "width") == pytest.approx(
        number(order, "x") + 20.0 * second, abs=0.2
    )
    assert held.findtext("title") == "bin1|gear_part_1, 2.0 s to 4.0 s"
    assert not shapes(picture, "rect", "ready_to_deliver")
    assert [each.text for each in shapes(picture, "text", "name")] == [
        "order_0",
        "order_1",
        "gripper",
        "AGV 1",
        "AGV 2",
    ]
    assert [each.text for each in shapes(picture, "text", "points")] == ["2 points", "0 points"]
    assert len(shapes(picture, "path", "kit")) == 2


@pytest.mark.parametrize("end", [0.0, 0.002, 1.0, 81.8, 500.0, 1e6])
def test_timeline_of_any_length_has_ticks(end: float) -> None:
    timeline: dict[str, Any] = {"end": end, "orders": [], "kits": [], "held": [], "agvs": {}}
    ticks = [each.text for each in shapes(timeline_picture(timeline), "text", "tick")]
    assert 1 <= len(ticks) <= 11
    assert ticks[0] == "0 s"
