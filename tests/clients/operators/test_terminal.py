"""Tests of the terminal of the keyboard operator."""

from __future__ import annotations

import io
import os
import sys
from typing import cast

import pytest
from rich.console import Console

from cellwright.clients.operators import terminal
from cellwright.clients.operators.keyboard import Jog
from cellwright.clients.operators.robot import OperatedRobot
from cellwright.util.errors import UsageError
from tests.clients.operators.test_jog import LIMITS, FakeRobot

if sys.platform != "win32":
    import termios


def test_stdin_without_terminal_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("q"))
    with pytest.raises(UsageError, match="stdin is not a terminal"), terminal.keyboard():
        pass


def test_table_of_joints_is_shown_without_joints() -> None:
    robot = cast("OperatedRobot", FakeRobot(joints=()))
    console = Console(width=120, file=io.StringIO())
    with console.capture() as capture:
        console.print(terminal._joints(robot, Jog(robot, LIMITS), LIMITS, 5))
    assert "measured" in capture.get()


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals there")
def test_keys_are_read_at_once_and_settings_of_terminal_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    keys, screen = os.openpty()
    before = termios.tcgetattr(screen)
    with os.fdopen(screen, "r") as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        with terminal.keyboard() as read:
            assert read() == ""
            os.write(keys, b"x\x1b[A")
            assert read() == "x\x1b[A"
            assert termios.tcgetattr(screen) != before
        assert termios.tcgetattr(screen) == before
    os.close(keys)
