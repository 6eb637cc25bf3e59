"""A trial that is recorded and killed: the recording is readable, and at most a second of it is lost."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from tests.recording.killed import loss

ROOM = 10.0
"""How much longer than here things may take elsewhere."""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no SIGKILL here")
@pytest.mark.parametrize("after", [0.11, 0.47, 0.83])
def test_what_was_recorded_is_kept(after: float, tmp_path: Path) -> None:
    found = loss(tmp_path, after)
    assert 0 <= found.kept <= found.reached
    assert found.wall < 1.0 * ROOM  # here it is a third of a second
