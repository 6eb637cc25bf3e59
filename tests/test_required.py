"""Without what its marker asks for a test is skipped, and fails in CI; with it, it runs."""

from types import ModuleType
from typing import Any

import pytest

from tests.browser import requirement as browser
from tests.ros1 import requirement as ros1

BOTH = pytest.mark.parametrize(("requirement", "marker"), [(browser, "browser"), (ros1, "ros1")])


class Item:
    """As much of a test as the hook looks at."""

    def __init__(self, *marks: str) -> None:
        self.marks = marks

    def get_closest_marker(self, name: str) -> str | None:
        return name if name in self.marks else None


def setup(requirement: ModuleType, item: Any) -> None:
    requirement.pytest_runtest_setup(item)


@BOTH
def test_skipped_with_the_reason(requirement: ModuleType, marker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "lacking", lambda: "nothing of it")
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match="nothing of it"):
        setup(requirement, Item(marker))


@BOTH
def test_a_failure_in_ci(requirement: ModuleType, marker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "lacking", lambda: "nothing of it")
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match=r"CI has to see .* nothing of it"):
        setup(requirement, Item(marker))
    setup(requirement, Item("slow"))


@BOTH
def test_runs_where_all_is_there(requirement: ModuleType, marker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "lacking", lambda: None)
    setup(requirement, Item(marker))
