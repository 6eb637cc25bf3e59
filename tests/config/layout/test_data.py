"""Layout as plain data, and back."""

import json
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.gripper import BOUNDS, Pad, ParallelGripperSettings
from cellwright.config.layout.data import layout_data, layout_from_data, plain, value_of
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.layout import Layout
from cellwright.util.errors import UsageError
from tests.support.places import LAYOUT

_FINGERS = st.builds(
    ParallelGripperSettings,
    opening=st.floats(*BOUNDS["opening"][:2]),
    force=st.floats(*BOUNDS["force"][:2]),
    speed=st.floats(*BOUNDS["speed"][:2]),
    pad=st.builds(
        Pad, size=st.tuples(*[st.floats(*BOUNDS["pad.size"][:2])] * 2), friction=st.floats(*BOUNDS["pad.friction"][:2])
    ),
)
st.register_type_strategy(ParallelGripperSettings, _FINGERS)


@settings(max_examples=50)
@given(layout=st.from_type(Layout))
def test_any_layout_comes_back_from_json_as_it_was(layout: Layout) -> None:
    # by text, in which NaN is NaN, and 1 is not 1.0
    assert repr(layout_from_data(json.loads(json.dumps(layout_data(layout))))) == repr(layout)


@pytest.mark.parametrize("number", [math.inf, -math.inf])
def test_infinite_numbers_are_texts_since_json_has_none(number: float) -> None:
    assert plain((number, 1.0)) == [str(number), 1.0]
    assert value_of(tuple[float, ...], plain((number, 1.0)), "numbers") == (number, 1.0)


def test_2017_comes_back_with_the_same_text() -> None:
    data = layout_data(gear2017())
    text = json.dumps(data)
    again = layout_from_data(json.loads(text))
    assert again == gear2017()
    assert json.dumps(layout_data(again)) == text


@pytest.mark.parametrize(
    ("place", "wrong", "text"),
    [
        ((), None, "layout: must be a dict (got None)"),
        (("bins",), {}, "layout.bins: must be a list (got {})"),
        (("bins", 2, "surface"), "high", "layout.bins[2].surface: must be a float (got 'high')"),
        (("bins", 2, "surface"), True, "layout.bins[2].surface: must be a float (got True)"),
        (("bins", 0, "size"), [1.0], "layout.bins[0].size: must have 2 entries (got [1.0])"),
        (("shelf",), {"position": [0, 0, 0]}, "layout.shelf: lacks quaternion"),
        (("bins", 1, "lid"), 0.1, "layout.bins[1]: has an unknown entry lid"),
        (("carriers", 0, "out", 0, 0), 3.0, "layout.carriers[0].out[0][0]: must be a str (got 3.0)"),
    ],
)
def test_other_data_are_refused_with_their_place(place: tuple[Any, ...], wrong: Any, text: str) -> None:
    data: Any = {"all": json.loads(json.dumps(layout_data(LAYOUT)))}
    *way, last = ("all", *place)
    at = data
    for each in way:
        at = at[each]
    at[last] = wrong
    with pytest.raises(UsageError) as error:
        layout_from_data(data["all"])
    assert text in str(error.value)
