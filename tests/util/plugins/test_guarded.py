"""Errors that plugins raise at run time."""

from pathlib import Path

import pytest

from cellwright.util.errors import RunEndedError, SimulationError
from cellwright.util.plugins import PluginFailedError, call_plugin, guard_plugin
from tests.support.workshop import describe


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install a package that provides a pump."""
    describe(tmp_path, "waterworks", {"cellwright.devices": {"pump": "waterworks:Pump"}})
    monkeypatch.syspath_prepend(str(tmp_path))


class FailingObject:
    """Object that raises a given error."""

    def __init__(self, error: BaseException | None = None) -> None:
        self.error = error

    def work(self, number: int) -> int:
        if self.error is not None:
            raise self.error
        return number + 1


def test_guarded_method_returns_its_result() -> None:
    plugin = FailingObject()
    assert guard_plugin(plugin, "devices", "pump", ["work"]) is plugin
    assert plugin.work(1) == 2
    assert call_plugin("devices", "pump", len, "abc") == 3


class OwnError(BaseException):
    """An error that `except Exception` does not catch."""


@pytest.mark.parametrize("error", [ValueError("dry"), SystemExit("dry"), OwnError("dry")])
def test_guarded_failure_names_plugin(error: BaseException) -> None:
    plugin = guard_plugin(FailingObject(error), "devices", "pump", ["work"])
    with pytest.raises(
        PluginFailedError,
        match=f"^device 'pump' of the package waterworks failed in work: {type(error).__name__}: dry$",
    ):
        plugin.work(1)


@pytest.mark.parametrize("error", [SimulationError("unstable"), RunEndedError("over"), KeyboardInterrupt()])
def test_guarded_method_passes_foreign_errors_on(error: BaseException) -> None:
    plugin = guard_plugin(FailingObject(error), "devices", "pump", ["work"])
    with pytest.raises(type(error)) as caught:
        plugin.work(1)
    assert caught.value is error
