"""Filters of entities: names by POSIX expressions, and shapes that overlap bounds."""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

import mujoco
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.viewer.services.entity_filters import MAX_FILTER_LENGTH, POSIX_CLASSES, expression, overlapping
from cellwright.viewer.services.simulation_requests import (
    BOX,
    FAILED,
    HULL,
    SPHERE,
    UNSUPPORTED,
    BoundsFields,
    RequestError,
    Vector,
)

SHAPES = """<mujoco><asset><mesh name="wedge" vertex="0 0 0 .2 0 0 0 .2 0 0 0 .2"/></asset><worldbody>
<geom name="box" type="box" size=".1 .1 .1" pos="1 0 0" euler="0 0 45"/>
<geom name="ball" type="sphere" size=".1" pos="0 1 0"/>
<geom name="rod" type="cylinder" size=".02 .3" pos="0 0 1" euler="0 90 0"/>
<geom name="wedge" type="mesh" mesh="wedge" pos="0 0 -1"/></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def shapes() -> tuple[mujoco.MjModel, mujoco.MjData, dict[str, Any]]:
    """Model with a shape of each kind on its own, and a place without a shape."""
    model = mujoco.MjModel.from_xml_string(SHAPES)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data, {**{model.geom(n).name: (n,) for n in range(model.ngeom)}, "place": (0.0, -1.0, 0.0)}


def within(shapes: Any, kind: int, *points: tuple[float, float, float]) -> set[str]:
    """Return the shapes that overlap bounds."""
    return overlapping(BoundsFields(kind, [Vector(*each) for each in points]), *shapes)


@pytest.mark.parametrize(
    ("points", "found"),
    [
        ([(2.0, 2.0, 2.0), (-2.0, -2.0, -2.0)], {"box", "ball", "rod", "wedge", "place"}),
        ([(-2.0, -2.0, -2.0), (2.0, 2.0, 2.0)], {"box", "ball", "rod", "wedge", "place"}),  # as Isaac Sim sends them
        ([(0.87, 0.01, 0.01), (0.0, -0.01, -0.01)], {"box"}),  # its turned corner reaches 0.859
        ([(0.85, 0.01, 0.01), (0.5, -0.01, -0.01)], set()),
        ([(0.95, 0.15, 0.01), (0.9, 0.1, -0.01)], set()),  # in its box along the axes, not in itself
        ([(0.31, 0.0, 1.0), (0.29, 0.0, 1.0)], {"rod"}),  # its end, far from its origin
        ([(0.05, 0.05, -0.95), (0.05, 0.05, -0.95)], {"wedge"}),
        ([(0.1, 0.1, -0.85), (0.1, 0.1, -0.85)], set()),
        ([(0.0, -1.0, 0.0), (0.0, -1.0, 0.0)], {"place"}),
    ],
)
def test_box_selects_shapes_that_overlap_it(shapes: Any, points: Any, found: set[str]) -> None:
    assert within(shapes, BOX, *points) == found


def test_sphere_selects_shapes_that_overlap_it(shapes: Any) -> None:
    assert within(shapes, SPHERE, (0.0, 0.0, 0.0), (0.81, 0.0, 0.0)) == {"wedge"}
    assert within(shapes, SPHERE, (0.0, 0.0, 0.0), (0.91, 9.0, 9.0)) == {"box", "ball", "wedge"}
    assert within(shapes, SPHERE, (0.0, 0.95, 0.0), (0.0, 0.0, 0.0)) == {"ball"}


def test_flat_hull_selects_shapes_that_it_cuts(shapes: Any) -> None:
    corners = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    assert within(shapes, HULL, *corners) == {"box", "ball", "rod"}
    assert within(shapes, HULL, (0.3, 0.3, 0.3), (0.4, 0.3, 0.3), (0.3, 0.4, 0.3)) == set()


@settings(deadline=None, max_examples=40)
@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3), st.tuples(*[st.floats(0.01, 1.0)] * 3))
def test_hull_of_corners_selects_as_their_box(shapes: Any, centre: Any, half: Any) -> None:
    corners = [
        tuple(c + s * h for c, s, h in zip(centre, signs, half, strict=True))
        for signs in itertools.product((-1, 1), repeat=3)
    ]
    assert within(shapes, HULL, *corners, centre) == within(shapes, BOX, corners[0], corners[-1])


@pytest.mark.parametrize(
    ("kind", "points", "code"),
    [
        (BOX, 3, FAILED),
        (SPHERE, 1, FAILED),
        (HULL, 2, FAILED),
        (HULL, 33, FAILED),
        (BOX, 0, FAILED),
        (9, 2, UNSUPPORTED),
    ],
)
def test_unclear_bounds_are_refused(shapes: Any, kind: int, points: int, code: int) -> None:
    with pytest.raises(RequestError, match="bounds") as caught:
        within(shapes, kind, *((float(n), n * n, n**3) for n in range(points)))
    assert caught.value.code == code


def test_endless_radius_negative_radius_and_line_are_refused(shapes: Any) -> None:
    for kind, points, reason in (
        (BOX, [(math.nan, 0.0, 0.0), (1.0, 1.0, 1.0)], "finite"),
        (SPHERE, [(0.0, 0.0, 0.0), (-1.0, 0.0, 0.0)], "radius"),
        (HULL, [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (2.0, 2.0, 2.0)], "on a line"),
    ):
        with pytest.raises(RequestError, match=reason):
            within(shapes, kind, *points)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("^bin8.*gear", ["bin8|gear_1"]),
        ("gear|pulley", ["bin8|gear_1", "pulley"]),  # a search, not a match of the whole name
        ("^[[:alpha:]]+$", ["arm", "pulley"]),
        ("^[[:alpha:][:digit:]]+$", ["arm", "pulley", "bin8"]),
        ("[^[:alnum:]_]", ["bin8|gear_1"]),
        ("[[:digit:]]$", ["bin8|gear_1", "bin8"]),
        ("^[]a]", ["arm"]),
        ("[[]", []),
        (r"[\d]$", []),  # in brackets a backslash stands for itself
        ("^[a-]", ["arm"]),
        ("bin8[|]", ["bin8|gear_1"]),
        ("[*+?{]", []),  # no repetitions
        (r"\|", ["bin8|gear_1"]),
        ("", ["arm", "bin8|gear_1", "pulley", "bin8"]),
    ],
)
def test_filter_is_posix_expression(text: str, names: list[str]) -> None:
    assert [each for each in ("arm", "bin8|gear_1", "pulley", "bin8") if expression(text).search(each)] == names


@given(st.sampled_from(sorted(POSIX_CLASSES)), st.characters(max_codepoint=127))
def test_class_has_its_characters_and_no_others(name: str, character: str) -> None:
    is_found = expression(f"^[[:{name}:]]").search(character) is not None
    assert is_found == (character in POSIX_CLASSES[name])
    assert is_found != (expression(f"^[^[:{name}:]]").search(character) is not None)


@given(st.text("ab-[]^:.=\\", max_size=12))
def test_any_brackets_are_read_or_refused(text: str) -> None:
    try:
        found = expression(f"[{text}]")
    except RequestError as error:
        assert "filter" in str(error)  # noqa: PT017
    else:
        assert isinstance(found, re.Pattern)


@pytest.mark.parametrize(
    "text",
    [
        *("(a+)+$", "(a*)*b", "a*b*c*d*", r"(a)\1", "x" * (MAX_FILTER_LENGTH + 1)),
        *("(", "[z-a]", "[", "[]", "[[:letter:]]", "[[.a.]]", "[[=a=]]", "([[:alpha:]]*)*x"),
    ],
)
def test_slow_or_wrong_filter_is_refused(text: str) -> None:
    with pytest.raises(RequestError, match="filter"):
        expression(text)


def test_nothing_near_the_bounds_selects_nothing() -> None:
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert overlapping(BoundsFields(BOX, [Vector(), Vector(1.0)]), model, mujoco.MjData(model), {}) == set()
