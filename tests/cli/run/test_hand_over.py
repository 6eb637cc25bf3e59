"""A policy works the humanoid of a cell: it hands a gear over, in this process and behind a server, with a latency."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import CommandLine
from tests.cli.run.hander import MAP, PROGRAM, Hander, write_files
from tests.support.policy_servers import openpi, websocket_server


@pytest.mark.slow
@pytest.mark.parametrize("latency", [(), ("--latency", "120ms", "--policy-mode", "sync")])
def test_policy_hands_the_gear_over_alike_in_process_and_behind_a_server(
    latency: tuple[str, ...], cellwright: CommandLine, tmp_path: Path
) -> None:
    write_files(tmp_path)

    def ran(policy: str, *more: str) -> dict[str, Any]:
        words = ("run", "hand_over", "--policy", policy, "--policy-map", MAP, *latency, *more, "--no-picture", "--json")
        document: dict[str, Any] = json.loads(cellwright(*words).out)
        return document

    own = ran(f"{PROGRAM}:Hander", "--record", "run.mcap")
    assert own["success"] is True
    with websocket_server(openpi(Hander().infer)) as address:
        served = ran(address)
    assert (served["success"], served["state_hash"]) == (True, own["state_hash"])
    assert cellwright("replay", "run.mcap", "--verify").status == 0
