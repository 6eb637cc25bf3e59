"""Without ROS 1 a test of it is skipped, and fails in CI; with it, it runs."""

from pathlib import Path
from typing import Any

import pytest

from tests.ros1 import requirement


class Item:
    """As much of a test as the hook looks at."""

    def __init__(self, *marks: str) -> None:
        self.marks = marks

    def get_closest_marker(self, name: str) -> str | None:
        return name if name in self.marks else None


def setup(item: Any) -> None:
    requirement.pytest_runtest_setup(item)


@pytest.fixture
def nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "lacking", lambda: "no rospy")


@pytest.mark.usefixtures("nothing")
def test_skipped_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match="no rospy"):
        setup(Item("ros1"))


@pytest.mark.usefixtures("nothing")
def test_a_failure_in_ci(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="no rospy"):
        setup(Item("ros1"))
    setup(Item("slow"))


def test_runs_where_all_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "lacking", lambda: None)
    setup(Item("ros1"))


def test_what_is_lacking_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked = requirement.lacking.__wrapped__
    monkeypatch.setattr(requirement, "ros_python", lambda: None)
    assert asked() == "no system Python with rospy: scripts/install-ros1 installs it"
    monkeypatch.setattr(requirement, "ros_python", lambda: "/usr/bin/python3")
    monkeypatch.setattr(requirement, "system_path", lambda: str(tmp_path))
    (tmp_path / "rostopic").touch(0o755)
    assert "without rosmaster, roscore, rosservice" in str(asked())
