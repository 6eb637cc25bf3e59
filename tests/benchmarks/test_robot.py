"""A robot's node beside PyBullet, with few steps."""

import math

import numpy as np
import pytest

from benchmarks import robot
from benchmarks.benchmarks import Curve, Figure
from cellwright.config.robot.robots import load_robot


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot, "ROBOT", "tandem")


def test_robot_figures_compare_node_with_pybullet() -> None:
    pytest.importorskip("pybullet")
    figures = [each for each in robot.measure(lambda _: None, quick=True) if isinstance(each, Figure)][:6]
    assert [figure.label for figure in figures[:3]] == [
        "240 Hz, at rest: the node",
        "240 Hz, at rest: PyBullet",
        "240 Hz, at rest: the node / PyBullet",
    ]
    assert [figure.minimum for figure in figures] == [None, None, None, 60.0, None, 25.0]
    assert all(figure.value > 0.0 for figure in figures)


def test_robot_figures_without_pybullet_measure_node_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot, "find_spec", lambda _: None)
    figures = [each for each in robot.measure(lambda _: None, quick=True) if isinstance(each, Figure)][:4]
    assert figures[-1].label == "240 Hz, moving: the node / PyBullet"
    assert math.isnan(figures[1].value)
    assert figures[1].note == "PyBullet is not installed"


def test_robot_growth_has_curve_with_bounded_bend() -> None:
    found = list(robot.measure(lambda _: None, quick=True))
    (curve,) = (each for each in found if isinstance(each, Curve))
    assert list(curve.sizes) == [10, 20, 60]
    last = found[-1]
    assert isinstance(last, Figure)
    assert last.maximum == 1.2


def test_robot_of_many_limbs_has_joints_and_follows() -> None:
    config = robot.many_limbs(12)
    assert len(config.robot.driven) == 12
    node = robot.NodeSide(config, 240, robot.Sines(config))
    robot.time_of(node, 240, 240, moving=True)
    goals = node.sines.at(1.0)
    assert np.abs(node.node.driver.read().positions - goals).max() < 0.3


def test_sines_go_on_from_one_measurement_to_the_next() -> None:
    config = robot.many_limbs(5)
    once, twice = (robot.NodeSide(config, 240, robot.Sines(config)) for _ in range(2))
    robot.time_of(once, 240, 480, moving=True)
    for _ in range(2):
        robot.time_of(twice, 240, 240, moving=True)
    assert once.node.simulation.state_hash() == twice.node.simulation.state_hash()


def test_robot_node_follows_targets_and_publishes_at_rate() -> None:
    config = load_robot(robot.ROBOT, lambda _: None)
    sines = robot.Sines(config)
    ours = robot.NodeSide(config, 240, sines)
    before = np.array(ours.node.commander.applied)
    robot.time_of(ours, 240, 120, moving=True)
    assert ours.received == 50
    assert not np.allclose(ours.node.commander.applied, before)
