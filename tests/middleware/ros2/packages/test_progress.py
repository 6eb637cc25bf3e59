"""Progress of an installation: estimates that follow what is done, and lines for terminals and for logs."""

from __future__ import annotations

import io
import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.ros2.packages import progress as module
from cellwright.middleware.ros2.packages.progress import Progress
from tests.support.waiting import wait_until


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def estimate(progress: Progress) -> tuple[float, float]:
    found = progress.estimate()
    assert found is not None
    return found


def test_no_estimate_before_the_first_step() -> None:
    progress = Progress(io.StringIO(), "install")
    assert progress.estimate() is None
    progress.plan({"a": 1.0})
    assert progress.estimate() is None


def test_slow_machine_has_longer_estimates() -> None:
    clock = Clock()
    progress = Progress(io.StringIO(), "install", clock)
    progress.plan({"a": 27.0, "b": 30.0})
    progress.begin("a")
    assert estimate(progress) == (0.0, 57.0)
    clock.now += 297.0
    progress.end("a")
    progress.begin("b")
    assert [*estimate(progress)] == pytest.approx([27 / 57, 300.0])
    progress.at("b", 0.5)
    assert [*estimate(progress)] == pytest.approx([42 / 57, 100.0])
    progress.end("b")
    assert estimate(progress) == (1.0, 0.0)


@given(st.lists(st.tuples(st.floats(0.1, 100), st.floats(0.01, 1000)), min_size=1, max_size=6), st.integers(2, 9))
def test_share_never_falls_and_ends_at_one(steps: list[tuple[float, float]], looks: int) -> None:
    clock = Clock()
    progress = Progress(io.StringIO(), "install", clock)
    progress.plan({str(number): expected for number, (expected, _) in enumerate(steps)})
    before = 0.0
    for number, (_, taken) in enumerate(steps):
        progress.begin(str(number))
        for _ in range(looks):
            clock.now += taken / looks
            share, left = estimate(progress)
            assert before - 1e-9 <= share < 1.0 + 1e-9
            assert 0.0 <= left < math.inf
            before = share
        progress.end(str(number))
    assert estimate(progress)[0] == pytest.approx(1.0)


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_estimate_is_shown_while_a_step_runs(stream: type[io.StringIO], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_INTERVALS", {False: 0.01, True: 0.01})
    shown = stream()
    with Progress(shown, "install") as progress:
        progress.plan({"a": 1000.0})
        progress.begin("a")
        progress.say("building")
        wait_until(lambda: "left" in shown.getvalue(), "estimate")
    ended = shown.getvalue()
    assert re.search(r"install: \d+ % done, about \d+ s left", ended)
    is_terminal = stream is Terminal
    assert ended.endswith("\r\x1b[K") == is_terminal
    assert ("\x1b" in ended) == is_terminal
    assert "install: building\n" in ended
    assert ended.count("\n") == (1 if is_terminal else len(ended.splitlines()))
