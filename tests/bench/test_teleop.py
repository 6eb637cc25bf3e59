"""From a command to motion, with few commands."""

import math

import pytest

from cellwright.bench import teleop
from cellwright.errors import UsageError


def test_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_environment: object) -> None:
        raise UsageError("there is no ROS 1")

    monkeypatch.setattr(teleop, "find", missing)
    monkeypatch.setattr(teleop, "REST", 0.15)
    figures = {figure.what: figure for figure in teleop.measure(lambda _: None, quick=True)}
    ros = figures.pop("until motion is told: over ROS 1")
    assert math.isnan(ros.value)
    assert ros.note == "skipped: there is no ROS 1"
    assert all(figure.value > 0.0 for figure in figures.values())
    assert len(figures) == 5


def test_waiting_alone() -> None:
    applied, moved = teleop.sampling(2000)
    assert all(0.0 < time <= 1 / 240 + 1e-12 for time in applied)
    assert all(0.0 < time <= 3 / 240 + 1e-12 for time in moved)
    assert sum(moved) > sum(applied)
