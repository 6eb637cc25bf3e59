"""Tests of `cellwright operate record` at a served node."""

from pathlib import Path

import pytest

from cellwright.cli.operate import record
from tests.cli.conftest import CommandLine


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["motion.txt"], "FILE motion.txt: give a file whose name ends in .csv"),
        (["no/motion.csv"], "there is no folder no"),
        (["motion.csv", "--duration", "0"], "--duration 0: give a time above 0 s"),
    ],
)
def test_invalid_input_writes_nothing(arguments: list[str], message: str, cellwright: CommandLine) -> None:
    ran = cellwright("operate", "record", *arguments, "--connect", "127.0.0.1:1")
    assert ran.status == 2
    assert message in ran.err
    assert not Path("motion.csv").exists()


def test_node_that_applies_no_targets_is_a_failure(
    cellwright: CommandLine, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(record, "APPLIED", "/io_teleop/nothing")
    ran = cellwright("operate", "record", "motion.csv", "--targets", "--duration", "0.05", "--connect", address)
    assert ran.status == 1
    assert ran.err == "error: no messages on /io_teleop/nothing\n"
    assert ran.out == "0 samples, 0.0 s, in motion.csv\n"
