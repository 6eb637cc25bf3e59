"""Arms of a layout and their mounts."""

import pytest

from cellwright.config.layout.arms import Arm, Mount, MountKind, original_mount
from cellwright.util.pose import Pose
from tests.support.places import LAYOUT


def test_arm_of_2017_moves_along_y_beside_the_bins() -> None:
    (arm,) = LAYOUT.arms
    assert arm == Arm("arm", original_mount(Pose((0.3, 0.0, 0.9))))
    assert arm.mount.ends == ((0.3, -2.1, 0.9), (0.3, 2.1, 0.9))
    assert (arm.is_original, arm.prefix) == (True, "")


def test_base_moves_along_the_axis_of_its_rail_alone() -> None:
    at = Pose((1.0, 2.0, 0.5))
    assert Mount("rail", at, axis="x", range=(-0.5, 1.5)).ends == ((0.5, 2.0, 0.5), (2.5, 2.0, 0.5))
    assert Mount("pedestal", at, range=(-0.5, 1.5)).ends == ((1.0, 2.0, 0.5), (1.0, 2.0, 0.5))


@pytest.mark.parametrize(("kind", "height", "count"), [("pedestal", 0.5, 1), ("table", 0.7, 5)])
def test_mount_stands_on_the_floor_and_ends_under_the_arm(kind: MountKind, height: float, count: int) -> None:
    found = Mount(kind, Pose((1.0, 2.0, height))).structure("stand")
    assert found is not None
    assert len(found.boxes) == count
    heights = [
        found.pose.transform(block.middle.transform((0.0, 0.0, side * block.size[2] / 2)))[2]
        for block in found.boxes
        for side in (-1, 1)
    ]
    assert (min(heights), max(heights)) == pytest.approx((0.0, height))


@pytest.mark.parametrize("mount", [Mount("floor", Pose()), Mount("rail", Pose()), Mount("pedestal", Pose())])
def test_nothing_of_its_own_stands_under_other_mounts(mount: Mount) -> None:
    assert mount.structure("stand") is None
