"""Command group `cellwright env`."""

from tests.cli.conftest import CommandLine


def test_group_without_command_lists_its_commands(cellwright: CommandLine) -> None:
    ran = cellwright("env")
    assert ran.status == 2
    assert "serve" in ran.out + ran.err
