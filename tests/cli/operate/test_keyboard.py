"""Tests of `cellwright operate keyboard` on its own terminal: keys arrive, and the terminal is restored."""

import os
import select
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from cellwright.clients.client.session import NodeClient
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.clients.operators.robot import OperatedRobot
from cellwright.robot.node import RobotNode
from tests.cli.conftest import CommandLine
from tests.clients.operators.nodes import robot, served
from tests.support.waiting import TIMEOUT, wait_until
from tests.support.warm import warm_start

pty = pytest.importorskip("pty")
termios = pytest.importorskip("termios")


class Terminal:
    """A terminal with the keyboard operator in it, or another command of `operate`."""

    def __init__(self, address: str, command: str = "keyboard") -> None:
        self.own, self.other = pty.openpty()
        termios.tcsetwinsize(self.own, (24, 80))
        self.before = termios.tcgetattr(self.other)
        with os.fdopen(os.dup(self.other), "r+b", buffering=0) as terminal:
            self.process = warm_start().popen(
                [sys.executable, "-m", "cellwright", "operate", command, "--connect", address],
                folder=Path.cwd(),
                environment={**os.environ, "TERM": "xterm", "PYTHONUNBUFFERED": "1"},
                terminal=terminal,
            )
        self.text = ""

    def read(self, until: Callable[[], bool]) -> None:
        """Read its output until a condition holds."""

        def take() -> None:
            if select.select([self.own], (), (), 0.05)[0]:
                self.text += os.read(self.own, 65536).decode(errors="replace")

        wait_until(until, "such state of the terminal", seen=lambda: self.text[-3000:], between=take)

    def type(self, text: str) -> None:
        os.write(self.own, text.encode())

    def status(self) -> int:
        self.read(lambda: self.process.poll() is not None)
        return self.process.wait(TIMEOUT)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(TIMEOUT)
        os.close(self.own)
        os.close(self.other)


@contextmanager
def terminal(address: str) -> Iterator[Terminal]:
    made = Terminal(address)
    try:
        made.read(lambda: "quit; the robot stays" in made.text)  # its last line is on the screen
        yield made
    finally:
        made.close()


def is_raw(terminal: Terminal) -> bool:
    return not termios.tcgetattr(terminal.other)[3] & termios.ICANON


@pytest.mark.slow
def test_keys_drive_robot_and_terminal_is_restored_at_any_end() -> None:
    with served(RobotNode(robot())) as (host, port):
        session = NodeClient(SocketTransport((host, port), node="/watcher"))
        there = OperatedRobot(session)
        with terminal(f"{host}:{port}") as first:
            assert is_raw(first)
            first.type("\x1b[B+\x1b[C")
            assert session.wait_until(lambda: there.positions["right_2"] > 0.64, TIMEOUT)
            first.type(" ")
            assert session.wait_until(lambda: there.status.emergency_stop, TIMEOUT)
            os.kill(first.process.pid, signal.SIGINT)  # as the terminal of a shell does on Ctrl-C
            assert first.status() == 0
            assert termios.tcgetattr(first.other) == first.before
            assert first.text.rstrip().endswith("2 messages sent; the robot holds its last targets")
            assert "\x1b[?1049l" in first.text  # the screen as well
        with terminal(f"{host}:{port}") as second:
            os.kill(second.process.pid, signal.SIGTERM)
            assert second.status() == 1
            assert termios.tcgetattr(second.other) == second.before
            assert "error: SIGTERM" in second.text
        session.close()


@pytest.mark.slow
def test_keyboard_ends_when_node_ends() -> None:
    with ExitStack() as stack:
        with served(RobotNode(robot())) as (host, port):
            keyboard = stack.enter_context(terminal(f"{host}:{port}"))
        assert keyboard.status() == 1
        assert "error: the test is over" in keyboard.text
        assert termios.tcgetattr(keyboard.other) == keyboard.before


def test_keyboard_without_terminal_names_other_commands(cellwright: CommandLine, address: str) -> None:
    ran = cellwright("operate", "keyboard", "--connect", address)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith(
        "error: the keyboard operator requires a terminal; without one use cellwright operate play"
    )
    assert ran.err.count("\n") == 1
