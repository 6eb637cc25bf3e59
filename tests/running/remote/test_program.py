"""Tests of the process of an agent: its report that it came too late."""

import json
from pathlib import Path

import pytest

from cellwright.running.remote import program
from cellwright.running.remote.program import ExitReason
from cellwright.util.errors import RunEndedError


def over(*_arguments: object, **_more: object) -> None:
    raise RunEndedError("the run is over")


def test_run_over_before_agent_connects_is_no_crash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "SocketTransport", over)
    report = tmp_path / "report.json"
    program.main(["socket", "127.0.0.1", "1", "/agent", "lesson", str(report), "30"])
    assert json.loads(report.read_text()) == {"parting": ExitReason.RUN_ENDED, "error": ""}
