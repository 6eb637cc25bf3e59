"""The arm of 2017 as a description."""

import pytest

from cellwright.config.arm import ARM_FRAMES, ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT
from cellwright.config.ur10 import FIGURES, UR10


def test_names_and_limits_are_those_of_the_controller() -> None:
    assert tuple(joint.name for joint in UR10.driven) == tuple(FIGURES) == ARM_JOINTS
    assert (UR10.root, *(joint.child for joint in UR10.joints)) == ARM_FRAMES
    assert [joint.limits.upper for joint in UR10.driven] == [RAIL_LIMIT, *[TURN_LIMIT] * 6]


def test_links_have_the_inertia_of_cylinders() -> None:
    forearm = UR10.links["forearm_link"].inertial
    assert forearm is not None
    assert forearm.mass == 3.87
    assert forearm.pose.position == (0.0, 0.0, 0.28615)
    # 1/12 m (3 r^2 + l^2) across and 1/2 m r^2 along, with a radius of 75 mm and the length of the link
    across, along = 3.87 * (3 * 0.075**2 + 0.5723**2) / 12, 3.87 * 0.075**2 / 2
    assert forearm.inertia == pytest.approx((across, across, along, 0.0, 0.0, 0.0))
