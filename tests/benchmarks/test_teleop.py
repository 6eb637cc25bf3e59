"""From a command to motion, with few commands."""

import math

import pytest

from benchmarks import teleop
from cellwright.util.errors import UsageError
from tests.support.quick_children import QUICK_SERVING


@QUICK_SERVING
@pytest.mark.slow
def test_teleop_quick_run_without_ros_yields_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_environment: object) -> None:
        raise UsageError("there is no ROS 1")

    monkeypatch.setattr(teleop, "find", missing)
    monkeypatch.setattr(teleop, "REST", 0.15)
    figures = {figure.label: figure for figure in teleop.measure(lambda _: None, quick=True)}
    ros = figures.pop("until motion is reported: over ROS 1")
    assert math.isnan(ros.value)
    assert ros.note == "skipped: there is no ROS 1"
    assert all(figure.value > 0.0 for figure in figures.values())
    assert len(figures) == 5


def test_sampling_delays_are_within_tick_and_message_period() -> None:
    applied, moved = teleop.sampling(2000)
    assert all(0.0 < time <= 1 / 240 + 1e-12 for time in applied)
    assert all(0.0 < time <= 3 / 240 + 1e-12 for time in moved)
    assert sum(moved) > sum(applied)


def test_in_process_command_is_applied_and_motion_published(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(teleop, "REST", 0.15)
    applied, moved = teleop.in_one_process(2)
    assert len(applied) == len(moved) == 2
    assert all(0.0 < time < 5.0 for time in (*applied, *moved))


def test_commands_alternate_in_sign() -> None:
    first, message = teleop._command(0)
    second, _ = teleop._command(1)
    assert first == -second == teleop.STEP
    assert (list(message.name), list(message.position)) == ([teleop.JOINT], [first])


def test_figure_of_times_has_median_and_note() -> None:
    found = teleop.figure("a way", [0.001, 0.002, 0.003], "computed")
    assert (found.label, found.unit) == ("a way", "ms")
    assert found.value == pytest.approx(2.0)
    assert found.note == "computed; median, 99 % below 3.0 ms"
