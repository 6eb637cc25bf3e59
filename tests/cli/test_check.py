"""Tests of `cellwright check`."""

import json

from tests.cli.conftest import CommandLine


def test_check_of_missing_file_prints_error_as_json(cellwright: CommandLine) -> None:
    ran = cellwright("check", "no.yaml", "--json")
    assert ran.status == 2
    assert json.loads(ran.out) == {
        "ok": False,
        "errors": ["no.yaml: there is no such file"],
        "warnings": [],
        "resolved": None,
    }
