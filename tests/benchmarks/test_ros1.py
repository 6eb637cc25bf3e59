"""Cost of ROS 1, with few messages."""

import pytest

from benchmarks import ros1
from benchmarks.benchmarks import BenchmarkSkippedError
from cellwright.util.errors import UsageError
from tests.support.quick_children import QUICK_SERVING


@QUICK_SERVING
@pytest.mark.ros1
def test_ros1_quick_run_yields_figures_without_loss() -> None:
    figures = {figure.label: figure for figure in ros1.measure(lambda _: None, quick=True)}
    assert figures["joint states at 1 kHz: lost"].value == 0
    assert figures["joint states at 1 kHz: rate"].value == pytest.approx(1000.0, rel=0.01)
    assert figures["a service, open connection: bare rospy"].value > 0.0
    assert figures["the bridge at 1 kHz, busy"].value >= 0.0


def test_ros1_benchmark_without_ros_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_environment: object) -> None:
        raise UsageError("there is no ROS 1")

    monkeypatch.setattr(ros1, "find", missing)
    with pytest.raises(BenchmarkSkippedError, match="there is no ROS 1"):
        list(ros1.measure(lambda _: None))


def test_bridged_round_trip_is_bounded_by_bare_one() -> None:
    bare, bridged = ros1.round_trip("a topic", [0.001, 0.001, 0.003], [0.0016, 0.0018, 0.002])
    assert bare.maximum is None
    assert (bare.value, bridged.value, bridged.maximum) == pytest.approx((1.0, 1.8, 1.7))
    assert not bridged.is_held


def test_bench_cell_echoes_joint_states() -> None:
    cell = ros1.bench_cell()
    received: list[object] = []
    cell.bus.subscribe("/bench/joint_states", received.append)
    for _ in range(10):
        cell.step()
    assert len(received) == 10
