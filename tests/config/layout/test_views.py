"""Views of layouts: those of 2017 as they are given, and computed ones that show all of their subject."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.layout.arms import Arm, Mount
from cellwright.config.layout.layout import Belt, Bin, Carrier, Layout, Tray
from cellwright.config.layout.surroundings import Block, Structure, View
from cellwright.config.layout.views import views
from cellwright.util.pose import Pose, Vector3
from tests.support.places import LAYOUT

ASPECT = 16 / 9
places = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-math.pi, math.pi))
sizes = st.tuples(st.floats(0.2, 2.0), st.floats(0.2, 2.0))
heights = st.floats(0.05, 1.5)


def pose(x: float, y: float, yaw: float) -> Pose:
    return Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw))


def belt(place: tuple[float, float, float], length: float) -> Belt:
    """Return a belt in its own direction."""
    x, y, yaw = place
    centre = Pose.from_rpy((x, y, 0.8), (0.0, 0.0, yaw))
    direction = (math.cos(yaw), math.sin(yaw), 0.0)
    return replace(LAYOUT.belts[0], centre=centre, direction=direction, size=(length, 0.6, 0.2))


def carrier(number: int, x: float, y: float, yaw: float) -> Carrier:
    """Return an AGV at a station."""
    return replace(LAYOUT.carriers[0], number=number, name=f"agv{number}", home=pose(x, y, yaw))


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    """Return layouts with any number of everything, and views of none of it, moved as a whole."""
    bins = [
        Bin(f"bin{n}", pose(*place), pose(*place), size, height)
        for n, (place, size, height) in enumerate(draw(st.lists(st.tuples(places, sizes, heights), max_size=6)))
    ]
    belts = draw(
        st.lists(st.builds(lambda place, length: belt(place, length), places, st.floats(0.5, 15.0)), max_size=2)
    )
    carriers = [carrier(n, *place) for n, place in enumerate(draw(st.lists(places, max_size=3)), 1)]
    trays = [
        Tray(len(carriers) + n, f"tray{n}", pose(*place), size, height)
        for n, (place, size, height) in enumerate(draw(st.lists(st.tuples(places, sizes, heights), max_size=3)), 1)
    ]
    arms = [Arm(f"arm{n}", Mount("rail", pose(*place))) for n, place in enumerate(draw(st.lists(places, max_size=2)))]
    named = (replace(each, name=f"belt{n}") for n, each in enumerate(belts))
    own = replace(LAYOUT, bins=tuple(bins), belts=tuple(named), carriers=tuple(carriers), trays=tuple(trays), views=())
    return replace(own, arms=tuple(arms)).moved(pose(*draw(places)))


def in_picture(view: View, point: Vector3) -> bool:
    """Return whether a point is inside the picture."""
    ahead = [to - at for to, at in zip(view.target, view.position, strict=True)]
    length = math.hypot(*ahead)
    x, y, z = (each / length for each in ahead)
    flat = math.hypot(x, y)
    right = (y / flat, -x / flat, 0.0)
    up = (-z * x / flat, -z * y / flat, flat)
    offset = [to - at for to, at in zip(point, view.position, strict=True)]
    deep, high, wide = (sum(a * b for a, b in zip(offset, axis, strict=True)) for axis in ((x, y, z), up, right))
    slope = math.tan(view.angle / 2)
    return deep > 0 and abs(high) < slope * deep and abs(wide) < slope * ASPECT * deep


def corners(middle: Pose, size: tuple[float, float], height: float) -> list[Vector3]:
    found = (middle.transform((x * size[0] / 2, y * size[1] / 2, 0.0)) for x in (-1, 1) for y in (-1, 1))
    return [(x, y, height) for x, y, _ in found]


def test_views_of_2017_are_those_given() -> None:
    assert views(LAYOUT) == LAYOUT.views
    assert [view.name for view in views(LAYOUT)] == ["overview", "bins", "agv1", "agv2", "belt"]


@given(layouts())
def test_computed_views_show_all_bins_and_trays(layout: Layout) -> None:
    found = {view.name: view for view in views(layout)}
    for each in layout.bins:
        for corner in corners(each.pose, each.size, each.surface):
            assert in_picture(found["overview"], corner)
            assert in_picture(found["bins"], corner)
    for tray in layout.stations:
        for corner in corners(tray.tray_surface, tray.plate, tray.surface):
            assert in_picture(found["overview"], corner)
            assert in_picture(found[tray.name], corner)


@given(layouts())
def test_there_is_a_view_of_each_belt_and_tray_and_no_other(layout: Layout) -> None:
    names = [view.name for view in views(layout)]
    bins = ["bins"] if layout.bins else []
    assert names == ["overview", *bins, *(each.name for each in layout.stations), *(each.name for each in layout.belts)]
    assert all(view.position[2] > 0.3 and 0 < view.angle < math.pi for view in views(layout))


def test_cell_of_nothing_has_a_view_of_its_middle() -> None:
    (view,) = views(replace(LAYOUT, bins=(), carriers=(), belts=(), views=(), arms=()))
    assert in_picture(view, (0.0, 0.0, 0.0))


@given(places, st.floats(0.5, 15.0))
def test_belt_alone_is_in_its_picture_whole(place: tuple[float, float, float], length: float) -> None:
    alone = replace(LAYOUT, bins=(), carriers=(), belts=(belt(place, length),), views=(), arms=())
    (view,) = (view for view in views(alone) if view.name == "belt")
    for corner in corners(alone.belts[0].centre, (length, 0.6), alone.belts[0].surface):
        assert in_picture(view, corner)


def test_own_view_replaces_a_computed_one_and_any_other_comes_last() -> None:
    own = (View("door", (0.0, -9.0, 2.0), (0.0, 0.0, 1.0), 0.8), View("bins", (0.0, 0.0, 9.0), (0.0, 0.1, 0.0), 0.9))
    found = {view.name: view for view in views(replace(LAYOUT, views=own))}
    assert list(found)[-1] == "door"
    assert found["bins"] == own[1]


@given(places)
def test_computed_views_move_with_the_cell(place: tuple[float, float, float]) -> None:
    bare = replace(LAYOUT, views=())
    for before, after in zip(views(bare), views(bare.moved(pose(*place))), strict=True):
        assert after.position == pytest.approx(before.moved(pose(*place)).position, abs=1e-6)


def test_tray_is_looked_at_from_where_neither_the_arm_nor_a_post_hides_it() -> None:
    tray = Tray(1, "tray1", pose(0.9, 0.4, 0.0))
    own = replace(LAYOUT, bins=(), carriers=(), belts=(), trays=(tray,), views=(), structure=())
    (view,) = (view for view in views(own) if view.name == "tray1")
    assert view.position[0] > 0.9, "beyond the rail at x = 0.3"
    fence = Structure("fence", pose(1.4, 0.4, 0.0), (Block(Pose((0.0, 0.0, 1.5)), (0.05, 4.0, 3.0)),))
    (view,) = (
        view
        for view in views(replace(own, structure=(fence,), arms=(Arm("arm", Mount("rail", Pose((9.0, 0.0, 0.9)))),)))
        if view.name == "tray1"
    )
    assert view.position[0] < 0.9
