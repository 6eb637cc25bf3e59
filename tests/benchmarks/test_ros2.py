"""Cost of ROS 2, with few messages."""

import pytest

from benchmarks import ros2
from benchmarks.benchmarks import BenchmarkSkippedError
from cellwright.util.errors import UsageError
from tests.ros2.ground import Ground
from tests.support.quick_children import QUICK_SERVING

pytest_plugins = ["tests.ros2.fixtures"]


@QUICK_SERVING
@pytest.mark.slow
@pytest.mark.ros2
def test_ros2_quick_run_yields_figures(domain: Ground, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros2, "DOMAIN", str(domain.domain))
    figures = {figure.label: figure for figure in ros2.measure(lambda _: None, quick=True)}
    assert figures["joint states at 1 kHz: rate"].value > 0.0
    assert 0.0 < figures["the clock: rate"].value <= 250.0 * 1.01
    for title in ros2.TRIPS.values():
        assert figures[f"{title}: bare rclpy"].value > 0.0
        assert figures[f"{title}: through bridge and cell / bare"].value > 0.0
    assert figures["the bridge at 1 kHz, busy"].value >= 0.0


def test_ros2_benchmark_without_ros_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise UsageError("there is no ROS 2")

    monkeypatch.setattr(ros2, "find", missing)
    with pytest.raises(BenchmarkSkippedError, match="there is no ROS 2"):
        list(ros2.measure(lambda _: None))
