"""Workplace: the cell's places in the arm's frame."""

import math
from dataclasses import replace

import pytest

from cellwright.clients.agents.kitter.workplace import BeltPlace
from cellwright.config.layout.layout import Bin, Layout, Tray
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import ARM, BELT, STATIONS, WORKPLACE, workplace
from tests.support.places import LAYOUT

TURNED = Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2))


def along_x(x: float, *, speed: float = 0.2) -> Layout:
    """Return 2017's layout with a belt past the end of the rail, towards x."""
    centre = Pose((x, -2.9, 0.8126))
    belt = replace(LAYOUT.belts[0], centre=centre, size=(4.0, 0.5, 0.2), direction=(1.0, 0.0, 0.0), speed=speed)
    return replace(LAYOUT, belts=(belt,))


def test_arm_frame_of_2017_is_the_world_to_the_bit() -> None:
    assert WORKPLACE.arm_T_world == Pose()
    assert [each.pose for each in WORKPLACE.bins] == [each.pose for each in LAYOUT.bins]
    assert STATIONS[1].world_T_tray == Pose.from_rpy((0.3, 3.15, 0.75), (0.0, 0.0, math.pi))
    assert STATIONS[2].world_T_tray == Pose((0.3, -3.15, 0.75))
    assert (STATIONS[1].rail, STATIONS[2].rail) == (2.1, -2.1)
    assert (BELT.first, BELT.last) == (-1.7, 1.8)


@pytest.mark.parametrize("by", [TURNED, Pose.from_rpy((-4.0, 0.5, 0.2), (0.0, 0.0, 0.5))])
def test_moved_cell_is_the_same_to_the_arm(by: Pose) -> None:
    moved = LAYOUT.moved(by)
    height = by.position[2]
    # surfaces are heights in the world, which a move along the vertical leaves as they are
    moved = replace(
        moved,
        bins=tuple(replace(each, surface=each.surface + height) for each in moved.bins),
        carriers=tuple(replace(each, surface=each.surface + height) for each in moved.carriers),
    )
    there = workplace(moved)
    for one, other in zip(there.stations.values(), STATIONS.values(), strict=True):
        assert one.world_T_tray.position == pytest.approx(other.world_T_tray.position, abs=1e-9)
        assert one.world_T_tray.yaw == pytest.approx(other.world_T_tray.yaw)
        assert one.surface == pytest.approx(other.surface)
        assert one.rail == pytest.approx(other.rail)
    assert [each.name for each in there.bins if each.covers(-0.3, 0.23)] == ["bin7"]
    (belt,) = there.belts
    assert belt.point(1.0) == pytest.approx(BELT.point(1.0))
    assert (belt.first, belt.last, belt.belt.surface) == pytest.approx((-1.7, 1.8, BELT.belt.surface))
    assert there.in_world(*belt.point(1.0)) == pytest.approx(by.transform((*BELT.point(1.0), 0.0))[:2])


def test_belt_point_and_coordinate_are_inverse() -> None:
    for place in (BELT, BeltPlace(along_x(0.3).belts[0])):
        for along in (-1.0, 0.3, 2.0):
            assert place.belt.along((*place.point(along), 0.9)) == pytest.approx(along)
            assert place.across((*place.point(along), 0.9)) == pytest.approx(place.across(place.belt.centre.position))


def test_belt_moves_a_pose_with_its_speed() -> None:
    pose = Pose((0.2, -2.9, 0.91))
    assert BeltPlace(along_x(0.0, speed=0.1).belts[0]).moved(pose, 3.0).position == pytest.approx((0.5, -2.9, 0.91))


def test_belt_past_the_end_of_the_rail_is_worked_where_the_arm_reaches() -> None:
    there = workplace(along_x(0.3))
    (belt,) = there.belts
    assert -0.8 < belt.first < 0.3 < belt.last < 1.4
    assert there.rail_along(belt, 0.3) == pytest.approx(ARM.rail_beside(0.3, -2.9))


def test_parts_are_taken_before_the_belt_loses_them() -> None:
    whole = replace(LAYOUT.belts[0], centre=Pose((1.21, 2.0, 0.8), LAYOUT.belts[0].centre.quaternion), wall=None)
    short = replace(whole, size=(4.0, *whole.size[1:]))  # ends at y = 0
    walled = replace(short, wall=Pose((1.21, 0.8, 1.4), whole.centre.quaternion))
    (dropping,), (stopping,) = (workplace(replace(LAYOUT, belts=(each,))).belts for each in (short, walled))
    # along the travel, which is -y: 0.3 m for the arm to follow it, and a part's length
    assert -0.51 < dropping.last < -0.39
    assert dropping.last - stopping.last == pytest.approx(0.8, abs=0.11)  # places are 0.1 m apart


def test_belt_out_of_reach_is_left_out_and_no_belt_is_none() -> None:
    belt = replace(LAYOUT.belts[0], centre=Pose((5.0, 0.0, 0.8)), size=(2.0, 0.5, 0.2))
    assert workplace(replace(LAYOUT, belts=(belt,))).belts == ()
    assert workplace(replace(LAYOUT, belts=())).belts == ()


def test_belts_in_opposite_directions_have_windows_from_their_upstream_end() -> None:
    (there,) = LAYOUT.belts
    back = replace(
        there,
        name="back",
        direction=(0.0, 1.0, 0.0),
        centre=Pose((-0.6, 3.0, 0.8), (math.sqrt(0.5), 0, 0, math.sqrt(0.5))),
        wall=None,
    )
    place = workplace(replace(LAYOUT, belts=(there, back)))
    belts = place.belts
    assert [(each.first, each.last) for each in belts] == [(-1.7, 1.8)] * 2
    assert belts[1].point(0.5) == pytest.approx((-0.6, 0.5))
    assert place.rail_along(belts[1], 0.5) == pytest.approx(0.5 + 0.163941 + 0.15)


def test_fixed_tray_is_a_station_without_quality_sensor() -> None:
    tray = Tray(3, "side_tray", Pose.from_rpy((1.1, 0.4, 0.0), (0.0, 0.0, math.pi / 2)), size=(0.4, 0.6), surface=0.9)
    place = workplace(replace(LAYOUT, carriers=(), trays=(tray,))).stations[3]
    assert (place.name, place.location, place.title) == ("side_tray", "side_tray", "side_tray")
    assert not place.has_quality_sensor
    assert (*place.half, place.surface, place.rail) == pytest.approx((0.2, 0.3, 0.9, 0.4 - 0.163941))
    assert place.covers(1.1 + 0.29, 0.4 + 0.19)
    assert not place.covers(1.1 + 0.21, 0.4 + 0.21)
    assert place.area.high == pytest.approx((1.4, 0.6, 0.92))


def test_turned_bin_covers_its_own_rectangle() -> None:
    turned = Bin(
        "bin1", Pose.from_rpy((-0.6, 0.0, 0.0), (0.0, 0.0, math.pi / 4)), Pose(), size=(0.8, 0.2), surface=0.95
    )
    place = workplace(replace(LAYOUT, bins=(turned,)))
    assert place.bin_at(-0.6 + 0.25, 0.25) is not None
    assert place.bin_at(-0.6 - 0.25, 0.25) is None
    assert place.highest == 0.95


def test_parts_are_dropped_where_nothing_is() -> None:
    assert WORKPLACE.drop_places[0] == (-0.15, 2.2, 1.5)
    box = Bin("bin1", Pose((-0.15, 2.2, 0.0)), Pose(), size=(0.6, 0.6))
    assert (-0.15, 2.2, 1.5) not in workplace(replace(LAYOUT, bins=(box,))).drop_places
