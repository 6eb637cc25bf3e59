"""Losses found by the numbers of messages, with one publisher and with several."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.ros2.bridge.publisher_numbers import PublisherNumbers


def lost(numbers: list[int], publishers: int = 1) -> list[int]:
    """Return the messages that are found lost before each number."""
    tracked = PublisherNumbers(lambda: publishers)
    return [tracked.note(number) for number in numbers]


@given(st.sets(st.integers(1, 60), min_size=1))
def test_gaps_of_one_publisher_are_lost_messages(arrived: set[int]) -> None:
    numbers = sorted(arrived)
    assert sum(lost(numbers)) == numbers[-1] - numbers[0] + 1 - len(numbers)


@given(st.lists(st.integers(0, 3), max_size=60), st.lists(st.integers(1, 20), min_size=4, max_size=4))
def test_interleaved_publishers_without_gaps_lose_nothing(order: list[int], begins: list[int]) -> None:
    """A publisher that joins late, or was there before, begins with any number."""
    newest = [begin - 1 for begin in begins]
    numbers = []
    for publisher in order:
        newest[publisher] += 1
        numbers.append(newest[publisher])
    assert not any(lost(numbers, publishers=4))


def test_gap_of_one_of_two_publishers_is_found() -> None:
    assert lost([1, 101, 2, 102, 5, 105, 6, 106], publishers=2) == [0, 0, 0, 0, 2, 2, 0, 0]


def test_restarted_publisher_loses_nothing() -> None:
    assert lost([1, 2, 3, 1, 2, 3]) == [0] * 6


def test_publisher_that_joins_first_one_loses_nothing() -> None:
    count = 1
    tracked = PublisherNumbers(lambda: count)
    assert [tracked.note(number) for number in (5, 6)] == [0, 0]
    count = 2
    assert [tracked.note(number) for number in (9, 7, 10)] == [0, 0, 0]
    count = 1
    assert [tracked.note(number) for number in (11, 13)] == [0, 1]


def test_middleware_without_numbers_loses_nothing() -> None:
    assert lost([2**64 - 1] * 5) == [0] * 5
