import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.robot.model import Joint, JointType, Limits, Mimic
from cellwright.robot.safety import SafetySettings
from cellwright.robot.target_limiter import MimicJoints, TargetLimiter
from cellwright.util.pose import Pose

LOWER, UPPER = np.array([-1.0, -1.0, -0.5]), np.array([1.0, 1.0, 0.5])


def joint(name: str, mimic: Mimic | None = None) -> Joint:
    return Joint(
        name=name, type=JointType.REVOLUTE, parent="a", child=name, origin=Pose(), limits=Limits(-1, 1), mimic=mimic
    )


def robot(multiplier: float, offset: float) -> tuple[MimicJoints, TargetLimiter]:
    joints = [joint("thumb"), joint("other"), joint("tip", Mimic("thumb", multiplier, offset))]
    names = tuple(each.name for each in joints)
    approach = TargetLimiter(names, LOWER, UPPER, np.full(3, 100.0), SafetySettings())
    approach.begin(np.zeros(3))
    return MimicJoints(joints, {name: number for number, name in enumerate(names)}), approach


def test_who_follows_whom() -> None:
    mimics, _ = robot(1.0, 0.0)
    assert mimics.leaders == {"tip": "thumb"}


@given(st.floats(-1, 1), st.floats(-3, 3), st.floats(-1, 1))
def test_a_follower_is_where_its_leader_has_it_within_its_own_limits(
    place: float, multiplier: float, offset: float
) -> None:
    mimics, approach = robot(multiplier, offset)
    approach.applied[0] = place
    mimics.carry(approach)
    assert approach.applied[2] == approach.desired[2] == pytest.approx(np.clip(multiplier * place + offset, -0.5, 0.5))
    assert approach.applied[1] == 0.0
