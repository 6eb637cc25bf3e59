import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.robot.model import Joint, JointType, Limits, Mimic
from cellwright.robot.servos import MimicJoints
from cellwright.util.pose import Pose

LOWER, UPPER = np.array([-1.0, -1.0, -0.5]), np.array([1.0, 1.0, 0.5])


def joint(name: str, mimic: Mimic | None = None) -> Joint:
    return Joint(
        name=name, type=JointType.REVOLUTE, parent="a", child=name, origin=Pose(), limits=Limits(-1, 1), mimic=mimic
    )


def robot(multiplier: float, offset: float) -> MimicJoints:
    joints = [joint("thumb"), joint("other"), joint("tip", Mimic("thumb", multiplier, offset))]
    return MimicJoints(joints, LOWER, UPPER)


def test_mimic_joints_name_followers_and_leaders() -> None:
    mimics = robot(1.0, 0.0)
    assert mimics.leaders == {"tip": "thumb"}
    assert mimics.followers.tolist() == [2]


@given(st.floats(-1, 1), st.floats(-3, 3), st.floats(-1, 1), st.floats(-1, 1))
def test_follower_position_is_clipped_to_its_limits(
    place: float, multiplier: float, offset: float, velocity: float
) -> None:
    mimics, positions = robot(multiplier, offset), np.array([place, 0.9, 0.7])
    now = multiplier * place + offset
    assert mimics.places(positions).tolist() == pytest.approx([np.clip(now, -0.5, 0.5)])
    soon = now + multiplier * velocity / 240
    velocities = np.array([velocity, 5.0, 5.0])
    assert mimics.places(positions, velocities, 240.0).tolist() == pytest.approx([np.clip(soon, -0.5, 0.5)])
