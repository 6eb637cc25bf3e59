"""Browser of the tests, and the message without one."""

from pathlib import Path

import pytest

from tests.browser import requirement


def test_browser_named_by_variable_comes_first(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
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


def test_missing_browser_is_named_with_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirement, "browser_path", lambda: None)
    assert "scripts/install-browser" in str(requirement.lacking())
