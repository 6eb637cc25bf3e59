"""Tests of the command table: every command exists, and is loaded from its place in the table."""

import os
from pathlib import Path
from typing import Any

import pytest
import typer

from cellwright.cli.main import COMMANDS, app
from tests.cli.conftest import CommandLine

GROUP = typer.main.get_command(app)


@pytest.mark.parametrize("name", COMMANDS)
def test_command_is_loaded_by_name(name: str) -> None:
    command = GROUP.get_command(None, name)  # type: ignore[attr-defined]
    assert command.name == name
    assert command is GROUP.get_command(None, name)  # type: ignore[attr-defined]


def test_unknown_command_is_refused_with_suggestion(cellwright: CommandLine) -> None:
    ran = cellwright("trails")
    assert ran.status == 2
    assert "No such command 'trails'. Did you mean 'trials'?" in ran.err


def test_table_of_commands_is_read_only() -> None:
    with pytest.raises(TypeError):
        GROUP.add_command(GROUP, "own")  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", ["run", "check", "serve", "view", "eval"])
def test_ctrl_c_while_files_are_read_has_status_of_shells(
    cellwright: CommandLine, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("own.yaml").touch()
    opened = os.open

    def interrupted(path: Any, *flags: Any, **more: Any) -> int:
        if str(path).endswith("own.yaml"):
            raise KeyboardInterrupt
        return opened(path, *flags, **more)

    monkeypatch.setattr(os, "open", interrupted)
    ran = cellwright(command, "own.yaml")
    assert (ran.status, ran.out, ran.err) == (130, "", "interrupted\n")


@pytest.mark.parametrize("command", [("trials",), ("serve", "lesson"), ("run", "lesson")])
def test_ros_arguments_without_ros2_are_refused_and_forgotten(
    cellwright: CommandLine, command: tuple[str, ...]
) -> None:
    ran = cellwright(*command, "--ros-args", "-r", "__ns:=/cell1")
    assert (ran.status, ran.err) == (2, "error: --ros-args requires --ros2\n")
    assert cellwright("trials").status == 0


def test_ros_argument_of_another_form_is_named_before_anything_starts(cellwright: CommandLine) -> None:
    ran = cellwright("serve", "lesson", "--ros2", "--ros-args", "-r", "__ns:cell1")
    reason = "--ros-args: -r __ns:cell1: not a rule; give -r FROM:=TO, such as -r __ns:=/cell1"
    assert (ran.status, ran.out, ran.err) == (2, "", f"error: {reason}\n")


def test_words_behind_ros_arguments_are_options_again(cellwright: CommandLine) -> None:
    ran = cellwright("serve", "--ros2", "--ros-args", "-r", "__ns:=/cell1", "--", "--ros2-range", "far", "lesson")
    assert (ran.status, ran.err) == (2, "error: --ros2-range far: give localhost or subnet\n")
