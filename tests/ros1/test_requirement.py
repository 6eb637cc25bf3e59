"""Reasons of skipped tests if ROS 1 is missing, or incomplete."""

from pathlib import Path

import pytest

from tests.ros1 import requirement


def test_missing_parts_of_ros1_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked = requirement.lacking.__wrapped__
    monkeypatch.setattr(requirement, "ros_python", lambda: None)
    assert asked() == "no system Python with rospy: scripts/install-ros1 installs it"
    monkeypatch.setattr(requirement, "ros_python", lambda: "/usr/bin/python3")
    monkeypatch.setattr(requirement, "system_path", lambda: str(tmp_path))
    (tmp_path / "rostopic").touch(0o755)
    assert "without rosmaster, roscore, rosservice" in str(asked())
