"""A robot's node beside PyBullet, with few steps."""

import math

import numpy as np
import pytest

from benchmarks import robot
from cellwright.config.robot.robots import load_robot


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot, "ROBOT", "tandem")


def test_robot_figures_compare_node_with_pybullet() -> None:
    pytest.importorskip("pybullet")
    figures = list(robot.measure(lambda _: None, quick=True))
    assert [figure.label for figure in figures[:3]] == [
        "240 Hz, at rest: the node",
        "240 Hz, at rest: PyBullet",
        "240 Hz, at rest: the node / PyBullet",
    ]
    assert len(figures) == 6
    assert all(figure.value > 0.0 for figure in figures)


def test_robot_figures_without_pybullet_measure_node_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot, "find_spec", lambda _: None)
    figures = list(robot.measure(lambda _: None, quick=True))
    assert len(figures) == 4
    assert math.isnan(figures[1].value)
    assert figures[1].note == "PyBullet is not installed"


def test_robot_node_follows_targets_and_publishes_at_rate() -> None:
    config = load_robot(robot.ROBOT, lambda _: None)
    sines = robot.Sines(config)
    ours = robot.NodeSide(config, 240, sines)
    before = np.array(ours.node.commander.applied)
    robot.time_of(ours, 240, 120, moving=True)
    assert ours.received == 50
    assert not np.allclose(ours.node.commander.applied, before)
