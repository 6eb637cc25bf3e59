"""Tests of the command group `cellwright operate`."""

from cellwright.cli.operate.command import app
from tests.cli.conftest import CommandLine


def test_group_has_each_command_under_its_own_name() -> None:
    names = [command.callback.__name__ for command in app.registered_commands if command.callback is not None]
    assert names == ["keyboard", "signal", "record", "play", "call", "cell"]


def test_unknown_command_is_refused_with_a_similar_name(cellwright: CommandLine) -> None:
    ran = cellwright("operate", "plays")
    assert ran.status == 2
    assert "Did you mean 'play'?" in ran.err
