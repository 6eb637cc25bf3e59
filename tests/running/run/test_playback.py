"""Tests of recordings as targets of a session."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.clients.client import Client
from cellwright.running.run import Session
from cellwright.util.errors import UsageError
from tests.running.run.test_session import Ends


def test_robot_is_recorded_and_recording_is_played(tmp_path: Path) -> None:
    with Session("tandem", record=tmp_path / "robot.mcap") as session:
        client = session.client("/operator")
        assert not isinstance(client, Client)
        with pytest.raises(UsageError, match="program: an agent needs a cell"):
            session.run(Ends())
        client.sleep(0.3)
    with Session(tmp_path / "robot.mcap") as played:
        result = played.run()
    assert result.outcome == "until"
    assert result.simulated == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize("option", ["record", "video"])
def test_recording_cannot_be_recorded_or_filmed(option: str, tmp_path: Path) -> None:
    with Session("tandem", record=tmp_path / "robot.mcap") as session:
        session.run(until=0.1)
    file = tmp_path / f"again.{'mcap' if option == 'record' else 'mp4'}"
    with pytest.raises(UsageError, match=f"^{option}: "):
        Session(tmp_path / "robot.mcap", record=file).run()
    assert not file.exists()
