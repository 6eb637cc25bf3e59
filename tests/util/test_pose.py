"""Poses: the pose of one frame in another."""

import math

from hypothesis import given
from hypothesis import strategies as st

from cellwright.util.pose import Pose

poses = st.builds(
    Pose.from_rpy, st.tuples(*[st.floats(-10.0, 10.0)] * 3), st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
)


@given(poses, poses)
def test_relative_pose_is_that_of_inverse_to_the_bit(world_T_a: Pose, world_T_b: Pose) -> None:
    assert world_T_a.relative(world_T_b) == world_T_a.inverse() @ world_T_b
