"""Tests of the help texts in 80 columns."""

import os
import re
from pathlib import Path

import pytest

import cellwright as package
from tests.cli.conftest import CommandLine

HELP = Path(__file__).parents[1] / "data" / "help"


COMMANDS = [
    "",
    "run",
    "eval",
    "eval merge",
    "eval compare",
    "serve",
    "env",
    "env serve",
    "teleop",
    "view",
    "replay",
    "check",
    "cell",
    "cell new",
    "cell schema",
    "cell reach",
    "cell export",
    "plot",
    "export",
    "trials",
    "robot",
    "operate",
    "operate keyboard",
    "operate signal",
    "operate play",
    "operate record",
    "operate call",
    "operate cell",
    "ros1-env",
    "ros1-workspace",
    "ros2-env",
    "ros2-workspace",
]


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help_equals_stored_text(command: str, option: str, cellwright: CommandLine) -> None:
    ran = cellwright(*command.split(), option)
    text = "".join(f"{line.rstrip()}\n" for line in ran.out.splitlines())
    file = HELP / f"{command.replace(' ', '-') or 'cellwright'}.txt"
    if os.environ.get("CELLWRIGHT_WRITE_HELP"):
        file.write_text(text, encoding="utf-8")
    assert ran.status == 0
    assert ran.err == ""
    assert text == file.read_text(encoding="utf-8")


@pytest.mark.parametrize("file", sorted(HELP.glob("*.txt")), ids=lambda file: file.stem)
def test_help_fits_80_columns_without_ellipsis(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert max(map(len, text.splitlines())) <= 80
    assert not re.search(r"\w…", text)


def test_command_line_without_command_prints_help(cellwright: CommandLine) -> None:
    ran = cellwright()
    assert ran.status == 2
    assert "cellwright run lesson" in ran.out + ran.err


def test_version_option_prints_version(cellwright: CommandLine) -> None:
    ran = cellwright("--version")
    assert (ran.status, ran.out, ran.err) == (0, f"cellwright {package.__version__}\n", "")
