"""Fixtures for tests of robots."""

import pytest

from cellwright.robot import drivers
from tests.support.waiting import TIMEOUT


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Extend the timeout: a driver thread on a busy machine has not failed."""
    monkeypatch.setattr(drivers, "FIRST_READING_TIMEOUT", TIMEOUT)
    defaults = drivers.LiveDriver.__init__.__kwdefaults__
    assert defaults is not None
    monkeypatch.setitem(defaults, "timeout", TIMEOUT)
