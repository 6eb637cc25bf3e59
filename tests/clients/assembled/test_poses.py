"""Poses from programs: any sequences of three and four numbers."""

from typing import Any

import pytest

from cellwright.clients.assembled.robot import pose_lists
from cellwright.util.errors import UsageError


def test_any_sequences_will_do() -> None:
    assert pose_lists(((1, 2, 3), (0, 0, 0, 1))) == [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]]


@pytest.mark.parametrize(
    "pose", [None, 1.0, [], [[0, 0, 0]], [[0, 0, 0], [0, 0, 0]], [["x", 0, 0], [0, 0, 0, 1]], "ab"]
)
def test_what_is_no_pose(pose: Any) -> None:
    with pytest.raises(UsageError, match="a pose is"):
        pose_lists(pose)
