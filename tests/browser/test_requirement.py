"""Without a browser a test of it is skipped, and fails in CI; with it, it runs."""

from pathlib import Path
from typing import Any

import pytest

from tests.browser import requirement


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
    monkeypatch.setattr(requirement, "lacking", lambda: "no Chromium")


@pytest.mark.usefixtures("nothing")
def test_skipped_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match="no Chromium"):
        setup(Item("browser"))


@pytest.mark.usefixtures("nothing")
def test_a_failure_in_ci(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="no Chromium"):
        setup(Item("browser"))
    setup(Item("slow"))


def test_runs_where_all_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "lacking", lambda: None)
    setup(Item("browser"))


def test_the_one_that_is_named_comes_first(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = requirement.browser_path.__wrapped__
    for name in ("google-chrome", "mine"):
        (tmp_path / name).touch(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv(requirement.VARIABLE, raising=False)
    assert found() == str(tmp_path / "google-chrome")
    monkeypatch.setenv(requirement.VARIABLE, "mine")
    assert found() == str(tmp_path / "mine")
    monkeypatch.setenv(requirement.VARIABLE, "another")
    assert found() is None


def test_what_is_lacking_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "browser_path", lambda: None)
    assert "scripts/install-browser" in str(requirement.lacking())
