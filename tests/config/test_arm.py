"""Names of the arm of 2017."""

from cellwright.cell.model.arm import JOINTS
from cellwright.config.arm import ARM_FRAMES, ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT


def test_names_and_limits_are_those_of_the_model() -> None:
    assert tuple(joint.name for joint in JOINTS) == ARM_JOINTS
    assert tuple(joint.link for joint in JOINTS) == ARM_FRAMES[1:8]
    assert [joint.limit for joint in JOINTS] == [RAIL_LIMIT, *[TURN_LIMIT] * 6]
