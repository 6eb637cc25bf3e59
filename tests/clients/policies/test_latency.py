"""Sources of latency: their texts, their bounds, and that nothing but the seed shifts drawn ones."""

from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.policies.latency import Latency, LatencyError, in_ticks
from cellwright.util.errors import UsageError

TICK = 2_000_000


@dataclass(frozen=True)
class Round:
    wall: float
    infer_ms: float | None = None


NOTHING = Round(0.0)


def drawn(text: str, seed: int, count: int = 5) -> list[Fraction]:
    source = Latency.read(text).source(seed)
    return [source(NOTHING) for _ in range(count)]


@pytest.mark.parametrize(
    ("text", "ticks"), [("120ms", 60), ("0.1s", 50), ("102 ms", 51), ("100.5ms", 51), ("0ms", 0), (".5ms", 1)]
)
def test_fixed_time_in_ticks_is_rounded_up(text: str, ticks: int) -> None:
    assert [in_ticks(each, TICK) for each in drawn(text, 1, 3)] == [ticks] * 3


def test_uniform_times_lie_within_their_bounds_and_fill_them() -> None:
    found = np.array(drawn("uniform:60..180ms", 3, 2000), float)
    assert 0.06 <= found.min() < 0.061
    assert 0.179 < found.max() <= 0.18


def test_normal_times_have_their_mean_and_deviation_and_none_is_negative() -> None:
    found = np.array(drawn("normal:120ms,20ms", 3, 4000), float)
    assert found.mean() == pytest.approx(0.12, abs=0.001)
    assert found.std() == pytest.approx(0.02, rel=0.05)
    assert min(drawn("normal:0ms,50ms", 3, 100)) == 0


def test_drawn_times_follow_from_the_seed_alone() -> None:
    assert drawn("uniform:60ms..180ms", 7) == drawn("uniform:60ms..180ms", 7)
    assert drawn("uniform:60ms..180ms", 7) != drawn("uniform:60ms..180ms", 8)


def test_times_of_a_file_come_in_their_order_and_repeat(tmp_path: Path) -> None:
    file = tmp_path / "times.txt"
    file.write_text("120\n\n 80.5 \n")
    assert [float(each) for each in drawn(f"file:{file}", 1)] == [0.12, 0.0805, 0.12, 0.0805, 0.12]


def test_measured_time_is_the_round_trip_or_that_of_the_server() -> None:
    answer = Round(0.13, 101.0)
    assert float(Latency.read("measured").source(1)(answer)) == pytest.approx(0.13)
    assert in_ticks(Latency.read("measured:server").source(1)(answer), TICK) == 51


@pytest.mark.parametrize(
    ("text", "answer", "words"),
    [
        ("measured:server", Round(0.1), "reports no infer_ms"),
        ("measured", Round(61.0), "took 61 s, more than 60 s"),
        ("measured:server", Round(0.1, -1.0), "took -0.001 s"),
        ("measured:server", Round(0.1, float("nan")), "took nan s"),
    ],
)
def test_measured_time_that_cannot_count_is_an_error(text: str, answer: Round, words: str) -> None:
    with pytest.raises(LatencyError, match=words):
        Latency.read(text).source(1)(answer)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fast", "unknown source; give 120ms, uniform:"),
        ("120", "unknown source"),
        ("-5ms", "unknown source"),
        ("nan ms", "unknown source"),
        ("61s", "must be from 0 to 60 s (got 61 s)"),
        ("uniform:60ms", "must have two times; write it as uniform:60ms..180ms"),
        ("uniform:90ms..60ms", "exchange them"),
        ("normal:120ms,x", "must be a time with its unit"),
        ("normal:120,20", "must be a time with its unit"),
        ("measured:client", "unknown source"),
        ("file:nowhere.txt", "there is no such file"),
    ],
)
def test_invalid_source_is_refused(text: str, words: str) -> None:
    with pytest.raises(UsageError) as caught:
        Latency.read(text)
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"--latency {text}")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("120\nabc\n", ":2: must be a number of milliseconds (got 'abc')"),
        ("1e9999\n", ":1: must be a number of milliseconds"),
        ("70000\n", ":1: must be from 0 to 60 s"),
        ("\n", ": must have 1 to 1000000 lines"),
    ],
)
def test_invalid_file_is_refused_with_its_line(content: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "times.txt"
    file.write_text(content)
    with pytest.raises(UsageError) as caught:
        Latency.read(f"file:{file}")
    assert f"{file}{words}" in str(caught.value)


@given(st.lists(st.fractions(0, 60), min_size=2, max_size=5))
def test_ticks_are_the_fewest_that_last_as_long(times: list[Fraction]) -> None:
    times.sort()
    for before, after in pairwise(times):
        assert in_ticks(before, TICK) <= in_ticks(after, TICK)
    for each in times:
        ticks = in_ticks(each, TICK)
        assert Fraction(ticks * TICK, 10**9) >= each > Fraction((ticks - 1) * TICK, 10**9)


@given(st.text(max_size=40))
def test_no_text_breaks_the_reader(text: str) -> None:
    with suppress(UsageError):
        Latency.read(text)
