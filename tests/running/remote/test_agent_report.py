"""Tests of the report of an agent's process."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.running.remote.hosting import read_report
from cellwright.running.remote.program import AgentExit, ExitReason


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('{"parting": "returned", "error": ""}', AgentExit(ExitReason.RETURNED)),
        ('{"parting": "crashed", "error": "a\\nb"}', AgentExit(ExitReason.CRASHED, "a\nb")),
        (r'{"parting": "crashed", "error": "\ud800\u001b[2J"}', AgentExit(ExitReason.CRASHED, r"\ud800\x1b[2J")),
        ('{"parting": "refused", "error": "no map"}', "no map"),
        ('{"parting": "refused", "error": ""}', "the agent could not be created"),
        ('{"parting": "gone", "error": ""}', ""),
        ('{"parting": "crashed"}', ""),
        ("", ""),
    ],
)
def test_report_gives_exit_of_agent_or_empty_text(tmp_path: Path, text: str, expected: AgentExit | str) -> None:
    file = tmp_path / "report.json"
    file.write_text(text, encoding="utf-8")
    assert read_report(file) == expected
    assert read_report(tmp_path / "none.json") == ""
