"""Bytes of the step service, compared with those of the library."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.cellwright_msgs import StepRequest, StepResponse
from cellwright.middleware.messages.conversions import duration, stamp
from cellwright.middleware.ros1.bridge.message_bytes import STEP_MD5, STEP_TYPE, read_step_request, step_response

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
COUNTS = st.integers(0, 2**64 - 1)


def test_step_checksum_matches_definition() -> None:
    assert TYPES.md5(STEP_TYPE) == STEP_MD5


@given(st.integers(0, 2**31 * 10**9 - 1), st.dictionaries(NAMES, COUNTS, max_size=5))
def test_step_request_round_trip(nanoseconds: int, published: dict[str, int]) -> None:
    counts = np.array(list(published.values()), np.uint64)
    data = TYPES.to_ros1(StepRequest(duration(nanoseconds), list(published), counts))
    assert read_step_request(data) == (nanoseconds, published)


def test_step_request_without_counts_has_no_published_messages() -> None:
    data = TYPES.to_ros1(StepRequest(duration(5), ["/a", "/b"]))
    assert read_step_request(data) == (5, {})


def test_step_request_with_negative_duration_is_read() -> None:
    assert read_step_request(struct.pack("<iiII", -2, 5, 0, 0)) == (-1_999_999_995, {})


@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=30), st.integers(0, 2**31 * 10**9 - 1))
def test_step_response_round_trip(failure: str, now: int) -> None:
    sent = [("/b", 3), ("/a", 2**40)]
    answer = TYPES.from_ros1(step_response(failure, now, sent), StepResponse)
    assert (answer.success, answer.message, answer.time) == (not failure, failure, stamp(now))
    assert list(zip(answer.topics, answer.sent.tolist(), strict=True)) == sent


@given(st.binary(max_size=60))
def test_random_step_request_bytes_are_read_or_refused(data: bytes) -> None:
    try:
        nanoseconds, published = read_step_request(data)
    except (struct.error, ValueError):
        return
    assert isinstance(nanoseconds, int)
    assert len(published) <= 60 // 8


@pytest.mark.parametrize("cut", range(1, 30, 3))
def test_step_request_that_is_cut_off_is_refused(cut: int) -> None:
    data = TYPES.to_ros1(StepRequest(duration(5), ["/a", "/b"], np.array([1, 2], np.uint64)))
    with pytest.raises((struct.error, ValueError)):
        read_step_request(data[:-cut])


def test_step_request_with_more_counts_than_topics_is_refused() -> None:
    data = TYPES.to_ros1(StepRequest(duration(5), ["/a"], np.array([1, 2], np.uint64)))
    with pytest.raises(ValueError, match="got 1 and 2"):
        read_step_request(data)
