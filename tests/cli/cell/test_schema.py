"""Command `cellwright cell schema`."""

import json

from cellwright.config.trial.schema import trial_schema
from tests.cli.conftest import CommandLine


def test_schema_is_printed_as_json(cellwright: CommandLine) -> None:
    ran = cellwright("cell", "schema")
    assert (ran.status, ran.err) == (0, "")
    assert json.loads(ran.out) == trial_schema()
