"""Process of a robot: it serves its program, and ends with it."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from socket import socket
from typing import Any, cast

import pytest

from cellwright.clients.assembled import process as services
from cellwright.robot import AssembledRobot
from cellwright.util.errors import CellwrightError, UsageError
from tests.clients.assembled.robots import configs, write_urdf
from tests.support.waiting import TIMEOUT, wait_until

PROGRAM = """
import json, signal, sys
from cellwright.robot import AssembledRobot
robot = AssembledRobot(sys.argv[1], json.loads(sys.argv[2]))
print(robot._process._process.pid, flush=True)
signal.pause()
"""


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_urdf(tmp_path_factory.mktemp("robot"))


def test_missing_interpreter_is_refused(urdf: Path) -> None:
    class Lost(AssembledRobot):
        python = "/no/such/python"

    with pytest.raises(UsageError, match="/no/such/python"):
        Lost(urdf, configs())


def test_interpreter_without_cellwright_is_refused(urdf: Path, tmp_path: Path) -> None:
    false = tmp_path / "false"
    false.write_text("#!/bin/sh\nexit 3\n")
    false.chmod(0o755)

    class Lost(AssembledRobot):
        python = str(false)

    with pytest.raises(UsageError, match="has ended with status 3"):
        Lost(urdf, configs())


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks processes up in /proc")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_robot_process_ends_with_its_program(urdf: Path, number: signal.Signals) -> None:
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(urdf), json.dumps(configs())],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    assert program.stdout is not None
    pid = int(program.stdout.readline())
    if number == signal.SIGINT:
        os.killpg(program.pid, number)  # as a terminal's Ctrl-C does
    else:
        program.send_signal(number)
    program.wait(TIMEOUT)
    program.stdout.close()
    wait_until(lambda: not Path(f"/proc/{pid}").exists(), "end of the robot's process")


@pytest.mark.slow
def test_dead_robot_process_is_reported_in_each_call(urdf: Path) -> None:
    robot = AssembledRobot(urdf, configs())
    robot._process._process.kill()
    with pytest.raises(CellwrightError, match="does not answer"):
        robot.move_j([1], [0.0])
    assert not robot.is_running
    with pytest.raises(CellwrightError, match="has ended"):
        robot.joint_states()
    robot.close()
    robot.close()


class Interrupted:
    """A connection on which a Ctrl-C interrupts a wait for an answer."""

    def __init__(self, connection: Any) -> None:
        self.sendall = connection.sendall

    def recv(self, _size: int) -> bytes:
        raise KeyboardInterrupt


@pytest.mark.slow
def test_answers_match_requests_after_ctrl_c(urdf: Path) -> None:
    robot = AssembledRobot(urdf, configs())
    process = robot._process
    connection = process._connection
    process._connection = cast("socket", Interrupted(connection))
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            robot.joint_states()
    process._connection = connection
    with pytest.raises(CellwrightError, match="index 99"):  # the first answers to come are those of the states
        process.ask(services.MOVE_SERVICE, joints=[99], positions=[0.0])
    robot.reset_j([1], [0.25])
    assert robot.joint_states().positions[1] == pytest.approx(0.25, abs=1e-6)
    robot.close()
