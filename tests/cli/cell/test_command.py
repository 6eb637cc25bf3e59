"""Command group `cellwright cell`."""

from tests.cli.conftest import CommandLine


def test_group_without_command_lists_its_commands(cellwright: CommandLine) -> None:
    ran = cellwright("cell")
    assert ran.status == 2
    assert "schema" in ran.out + ran.err
