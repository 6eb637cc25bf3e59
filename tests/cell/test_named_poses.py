"""Named poses: places where parts are put, each with free space over it."""

import pytest

from cellwright.cell.model.frames import BELT_SURFACE, BIN_SURFACE, TRAY_SURFACE
from cellwright.cell.named_poses import CLEARANCE, named_poses
from cellwright.config.layout import TRAY_PLATE


def test_places_are_bins_belt_and_the_given_trays() -> None:
    names = [each.name for each in named_poses([2])]
    assert names == [*(f"bin{k}" for k in range(1, 9)), "belt_start", "agv2_load_point", "kit_tray_2"]
    assert len(named_poses([])) == 9


def test_poses_are_on_the_surfaces() -> None:
    heights = {each.name: each.pose.position[2] for each in named_poses([1])}
    assert (heights["bin1"], heights["belt_start"], heights["kit_tray_1"]) == (BIN_SURFACE, BELT_SURFACE, TRAY_SURFACE)


def test_space_is_over_the_pose_and_turned_with_it() -> None:
    (tray,) = (each for each in named_poses([1]) if each.name == "kit_tray_1")
    size = [upper - lower for lower, upper in zip(tray.space.lower, tray.space.upper, strict=True)]
    assert sorted(size[:2]) == pytest.approx(sorted(TRAY_PLATE))
    assert tray.space.lower[2] == tray.pose.position[2]
    assert size[2] == pytest.approx(CLEARANCE)
