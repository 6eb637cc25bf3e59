"""Tests of an agent at a served cell, from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.running.test_serving import ended, serving


@pytest.mark.slow
def test_agent_works_served_cell_with_connect(cellwright: CommandLine, agents: str, tmp_path: Path) -> None:
    with serving(tmp_path, "lesson", "--lockstep") as (process, (host, port)):
        at = f"{host}:{port}"
        ran = cellwright("run", "--connect", at, "--agent", f"{agents}:Waits2", "--min-score", "1")
        assert (ran.status, ran.err.count("\n")) == (2, 1)
        ran = cellwright("run", "--connect", at, "--agent", f"{agents}:Ends", "--min-score", "1")
        assert ran.status == 1
        assert ran.out.startswith(f"trial lesson, agent {agents}:Ends, at {at}\n")
        assert "score       0 of 12 points\n" in ran.out
        assert "not enough  below --min-score 1\n" in ran.out
        again = cellwright("run", "--connect", at, "--agent", f"{agents}:Crashes", "--json")
        result = json.loads(again.out)
        assert (again.status, result["competition_state"], result["trial"]) == (1, "done", "lesson")
        assert result["error"].endswith("ValueError: no idea\n")
        status, out, _ = ended(process)
        assert status == 0
        assert f"state hash  {result['state_hash']}\n" in out
