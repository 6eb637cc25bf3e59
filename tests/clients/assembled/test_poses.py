"""Poses from programs: any sequences of three and four numbers."""

from typing import Any

import pytest

from cellwright.clients.assembled.robot import pose_lists
from cellwright.util.errors import UsageError


def test_pose_lists_accepts_any_sequences() -> None:
    assert pose_lists(((1, 2, 3), (0, 0, 0, 1))) == [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]]


@pytest.mark.parametrize(
    "pose", [None, 1.0, [], [[0, 0, 0]], [[0, 0, 0], [0, 0, 0]], [["x", 0, 0], [0, 0, 0, 1]], "ab"]
)
def test_pose_lists_refuses_malformed_pose(pose: Any) -> None:
    with pytest.raises(UsageError, match="a pose is"):
        pose_lists(pose)
