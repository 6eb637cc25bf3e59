"""Conversions between messages and values: shifted stamps."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import header, nanoseconds, shifted, stamp, wrapped_stamp
from cellwright.middleware.messages.osrf_gear import Proximity
from cellwright.middleware.messages.standard import GoalID, GoalStatus, GoalStatusArray, Time

STAMPS = st.builds(Time, st.integers(-(1 << 31), (1 << 31) - 1), st.integers(0, 999_999_999))


def test_stamps_are_shifted_at_all_depths() -> None:
    given_at = stamp(2_000_000_001)
    message = GoalStatusArray(header("world", 10**9), [GoalStatus(GoalID(given_at, "a"), 1, "text")])
    moved = shifted(message, 1_500_000_000)
    assert nanoseconds(moved.header.stamp) == 2_500_000_000
    assert nanoseconds(moved.status_list[0].goal_id.stamp) == 3_500_000_001
    assert (moved.header.frame_id, moved.status_list[0].text) == ("world", "text")
    assert nanoseconds(message.header.stamp) == 10**9
    assert TYPES.to_cdr(shifted(moved, -1_500_000_000)) == TYPES.to_cdr(message)


@pytest.mark.parametrize("by", [0, 10**9])
def test_message_without_time_is_not_shifted(by: int) -> None:
    message = Proximity(header("frame"), True, 0.0, 1.0)
    assert TYPES.to_cdr(shifted(message, by)) == TYPES.to_cdr(message)


@given(st.integers(-(1 << 70), 1 << 70))
def test_stamp_from_outside_can_always_be_written(time: int) -> None:
    wrapped = wrapped_stamp(time)
    TYPES.to_cdr(GoalID(wrapped, ""))
    assert (nanoseconds(wrapped) - time) % (2**32 * 10**9) == 0


@given(STAMPS, st.integers(1, 10**18))
def test_any_stamp_can_be_shifted_and_written(time: Time, by: int) -> None:
    message = GoalStatus(GoalID(time, ""), 0, "")
    moved = shifted(message, -by)
    TYPES.to_cdr(moved)
    if nanoseconds(moved.goal_id.stamp):
        assert TYPES.to_cdr(shifted(moved, by)) == TYPES.to_cdr(message)
