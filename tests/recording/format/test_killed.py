"""A recorded trial that is killed: the recording is readable, and keeps what had come to the file."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from tests.recording.format.killed import TICK, loss


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no SIGKILL here")
@pytest.mark.parametrize("after", [10, 150, 400])
def test_killed_run_keeps_recorded_messages(after: int, tmp_path: Path) -> None:
    found = loss(tmp_path, after)
    assert after * TICK <= found.kept <= found.reached + TICK  # the kill may come between the two notes of a tick
