"""Named poses: places where parts are put, each with free space over it."""

import pytest

from cellwright.cell.named_poses import CLEARANCE, named_poses
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Options, Trial
from tests.support.places import BELT_SURFACE, BIN_SURFACE, TRAY_PLATE, TRAY_SURFACE

TRAYS = ["agv1_load_point", "kit_tray_1", "agv2_load_point", "kit_tray_2"]


def test_places_are_bins_belt_and_trays() -> None:
    names = [each.name for each in named_poses(Trial("places"))]
    assert names == [*(f"bin{k}" for k in range(1, 9)), "belt_start", *TRAYS]
    assert len(named_poses(Trial("bare", options=Options(insert_agvs=False)))) == 9


def test_places_of_the_layout_come_last_and_move_with_the_cell() -> None:
    text = "cell: {frame: {at: [1, 0], turn: pi/2}, bins: {a: {at: [0, 0]}}, places: {aside: {at: [2, 0, 0.8]}}}"
    found = named_poses(load_trial(text=text).trial)
    assert [each.name for each in found] == ["a", "aside"]
    assert found[-1].tags == ("place",)
    assert found[-1].pose.position == pytest.approx((1.0, 2.0, 0.8))


def test_poses_are_on_the_surfaces() -> None:
    heights = {each.name: each.pose.position[2] for each in named_poses(Trial("places"))}
    assert (heights["bin1"], heights["belt_start"], heights["kit_tray_1"]) == (BIN_SURFACE, BELT_SURFACE, TRAY_SURFACE)


def test_space_is_over_the_pose_and_turned_with_it() -> None:
    (tray,) = (each for each in named_poses(Trial("places")) if each.name == "kit_tray_1")
    size = [upper - lower for lower, upper in zip(tray.space.lower, tray.space.upper, strict=True)]
    assert sorted(size[:2]) == pytest.approx(sorted(TRAY_PLATE))
    assert tray.space.lower[2] == tray.pose.position[2]
    assert size[2] == pytest.approx(CLEARANCE)
