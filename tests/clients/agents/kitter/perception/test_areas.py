"""View of a logical camera, and the areas of the cell in it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.logical_camera import LogicalCamera
from cellwright.cell.devices.scene import Frustum
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.perception import is_well_in_view, view_of
from cellwright.clients.agents.kitter.workplace import Area
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import BELT, BELT_MIDDLE, BELT_SURFACE, BINS, STATIONS, WORKPLACE

DOWN = (0.0, math.pi / 2, 0.0)
turns = st.floats(-3.1, 3.1)
places = st.floats(-1.0, 1.0)


def camera(x: float, y: float, z: float = 1.465) -> Pose:
    return Pose.from_rpy((x, y, z), DOWN)


@pytest.mark.parametrize(
    ("world_T_camera", "seen"),
    [
        (camera(-0.3, 0.23), [BINS[6]]),
        (camera(0.3, 3.15), [STATIONS[1].area]),
        (camera(0.3, -3.15), [STATIONS[2].area]),
        (camera(1.21, 2.6, 1.645), [BELT.area]),
        (camera(1.21, 9.0, 1.645), [BELT.area]),  # upstream of the arm's reach
        (camera(-0.3, 0.23, 3.0), []),  # too high
        (Pose.from_rpy((-0.3, 0.23, 1.465), (0.0, -math.pi / 2, 0.0)), []),  # it looks up
    ],
)
def test_camera_view_meets_areas_below_camera(world_T_camera: Pose, seen: list[Area]) -> None:
    areas = [BINS[0], BINS[6], BELT.area, STATIONS[1].area, STATIONS[2].area]
    assert [area for area in areas if area.meets(view_of(world_T_camera, Catalogue().max_extent))] == seen


@given(st.tuples(places, places, places), st.tuples(turns, turns, turns), st.tuples(places, places, places))
def test_camera_view_contains_every_visible_point(
    xyz: tuple[float, float, float], rpy: tuple[float, float, float], point: tuple[float, float, float]
) -> None:
    """Against the cell's own camera: it has a part in view whose box meets the frustum."""
    world_T_camera = Pose.from_rpy(xyz, rpy)
    view = Frustum(
        world_T_camera,
        near=LogicalCamera.near,
        far=LogicalCamera.far,
        horizontal_fov=LogicalCamera.horizontal_fov,
        aspect=LogicalCamera.aspect,
    )
    in_view = bool(view.meets(np.array([point]), np.full((1, 3), 0.01))[0])
    if in_view:
        assert Area.around([point]).meets(view_of(world_T_camera, Catalogue().max_extent))
    else:
        assert not is_well_in_view(world_T_camera, point)


def test_point_at_edge_of_view_is_not_well_in_view() -> None:
    over_bin_7 = camera(-0.3, 0.23)
    assert is_well_in_view(over_bin_7, (-0.3, 0.23, 0.735))
    assert is_well_in_view(over_bin_7, (-0.3, 0.66, 0.735))
    assert not is_well_in_view(over_bin_7, (-0.3, 0.685, 0.735))
    assert not is_well_in_view(over_bin_7, (-0.3, 0.23, 1.3))


def test_bin_of_a_point_is_that_below_it() -> None:
    assert [each and each.name for each in (WORKPLACE.bin_at(-0.3, 0.23), WORKPLACE.bin_at(-0.55, 0.5))] == ["bin7"] * 2
    assert WORKPLACE.bin_at(BELT_MIDDLE, 0.23) is None


def test_areas_with_common_point_meet() -> None:
    one = Area((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    assert one.meets(Area((1.0, 0.5, 0.5), (2.0, 2.0, 2.0)))
    assert not one.meets(Area((1.1, 0.5, 0.5), (2.0, 2.0, 2.0)))
    assert Area.around([(1.0, 5.0, 3.0), (2.0, 4.0, 3.0)], 0.5) == Area((0.5, 3.5, 2.5), (2.5, 5.5, 3.5))
    assert BELT.area.low[2] < BELT_SURFACE < BELT.area.high[2]
