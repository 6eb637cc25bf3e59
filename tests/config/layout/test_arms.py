"""Arms of a layout."""

from cellwright.util.pose import Pose
from tests.support.places import LAYOUT


def test_arm_of_2017_moves_along_y_beside_the_bins() -> None:
    (arm,) = LAYOUT.arms
    assert (arm.name, arm.pose) == ("arm", Pose((0.3, 0.0, 0.9)))
