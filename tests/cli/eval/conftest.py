"""Two tiny trials and programs for them, in the folder of the command line; a module may have its own."""

from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.running.evaluation.programs import PROGRAMS, TRIAL


@pytest.fixture
def tiny(cellwright: CommandLine) -> CommandLine:
    Path("tiny.yaml").write_text(TRIAL, encoding="utf-8")
    Path("other.yaml").write_text(TRIAL + "time_limit: 400\n", encoding="utf-8")
    Path("programs.py").write_text(PROGRAMS, encoding="utf-8")
    return cellwright
