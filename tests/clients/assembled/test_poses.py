"""Poses as lists obey the laws of rigid motion, and agree with Cellwright's own."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.assembled.robot import invert_pose, multiply_poses, pose_lists
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

NUMBERS = st.floats(-2.0, 2.0, allow_subnormal=False)


@st.composite
def poses(draw: st.DrawFn) -> list[list[float]]:
    turn = [draw(NUMBERS) for _ in range(4)]
    length = math.hypot(*turn)
    turn = [value / length for value in turn] if length > 0.1 else [0.0, 0.0, 0.0, 1.0]
    return [[draw(NUMBERS) for _ in range(3)], turn]


def own(pose: list[list[float]]) -> Pose:
    (x, y, z), (qx, qy, qz, qw) = pose
    return Pose((x, y, z), (qw, qx, qy, qz))


def close(first: list[list[float]], second: list[list[float]]) -> bool:
    same = sum(a * b for a, b in zip(first[1], second[1], strict=True))  # a quaternion and its opposite are one turn
    return first[0] == pytest.approx(second[0], abs=1e-9) and abs(same) == pytest.approx(1.0, abs=1e-9)


@given(poses(), poses(), poses())
def test_it_counts_for_nothing_what_is_multiplied_first(a: Any, b: Any, c: Any) -> None:
    assert close(multiply_poses(multiply_poses(a, b), c), multiply_poses(a, multiply_poses(b, c)))


@given(poses())
def test_the_inverse_undoes(pose: Any) -> None:
    assert close(multiply_poses(pose, invert_pose(pose)), [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    assert close(invert_pose(invert_pose(pose)), pose)


@given(poses(), poses())
def test_the_product_is_that_of_poses(a: Any, b: Any) -> None:
    product = own(a) @ own(b)
    w, x, y, z = product.quaternion
    assert close(multiply_poses(a, b), [list(product.position), [x, y, z, w]])


def test_any_sequences_will_do() -> None:
    assert pose_lists(((1, 2, 3), (0, 0, 0, 1))) == [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]]


@pytest.mark.parametrize(
    "pose", [None, 1.0, [], [[0, 0, 0]], [[0, 0, 0], [0, 0, 0]], [["x", 0, 0], [0, 0, 0, 1]], "ab"]
)
def test_what_is_no_pose(pose: Any) -> None:
    with pytest.raises(UsageError, match="a pose is"):
        pose_lists(pose)
