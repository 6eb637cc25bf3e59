"""Reasons of skipped tests if ROS 2 is missing, or lacks interfaces."""

import pytest

from cellwright.middleware.ros2.host.installation import Installation
from tests.ros2 import requirement


def test_missing_parts_of_ros2_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = requirement.lacking.__wrapped__
    monkeypatch.setattr(requirement, "installation", lambda: None)
    assert asked() == "no Python with rclpy: scripts/install-ros2 installs it"
    found = Installation("/usr/bin/python3", {}, "humble", ("osrf_gear", "tf2_msgs"))
    monkeypatch.setattr(requirement, "installation", lambda: found)
    assert asked() == "ROS 2 is here without osrf_gear, tf2_msgs: scripts/install-ros2 installs it"
    monkeypatch.setattr(requirement, "installation", lambda: Installation("/usr/bin/python3", {}, "jazzy"))
    assert asked() is None
