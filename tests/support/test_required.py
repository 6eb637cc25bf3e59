"""Tests of markers: without its requirement a test is skipped, and fails in CI; with it, it runs."""

from typing import Any

import pytest

from tests.support import required
from tests.support.required import MARKERS, pytest_runtest_setup, reason_to_skip

each_marker = pytest.mark.parametrize("marker", MARKERS)


class Item:
    """The attributes of a test that the hook reads."""

    def __init__(self, *marks: str) -> None:
        self.marks = marks

    def get_closest_marker(self, name: str) -> str | None:
        return name if name in self.marks else None


def setup(*marks: str) -> None:
    item: Any = Item(*marks)
    pytest_runtest_setup(item)


@each_marker
def test_missing_requirement_skips_with_reason(marker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(required, "reason_to_skip", lambda name: f"nothing of {name}")
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match=f"nothing of {marker}"):
        setup(marker)


@each_marker
def test_missing_requirement_in_ci_fails(marker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(required, "reason_to_skip", lambda _: "nothing of it")
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match=f"CI has to see {MARKERS[marker]}, but there is nothing of it"):
        setup(marker)
    setup("slow")


@each_marker
def test_met_requirement_runs_test(marker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(required, "reason_to_skip", lambda _: None)
    setup(marker)


def test_display_without_program_names_install_script(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    assert "scripts/install-display" in str(reason_to_skip("display"))
