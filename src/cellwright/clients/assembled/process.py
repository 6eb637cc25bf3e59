"""Robot process: starts a robot in a process of its own, connects to it, and calls its services."""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import socket
import subprocess
import threading
from pathlib import Path
from typing import Any, Mapping

from cellwright.middleware.wire.frames import Decoder, Frame, FrameError, FrameKind, hello
from cellwright.util.errors import CellwrightError, UsageError, printable

DESCRIBE_SERVICE = "/cellwright/robot/describe"
"""Description of the robot: joints, arms, grippers, head, lift, and the pose of its root link."""
STATE_SERVICE = "/cellwright/robot/state"
"""Positions, velocities and efforts of all movable joints, positions and targets of the driven ones. Also the pose of
the body that carries the robot, and the poses of requested links by index.
"""
MOVE_SERVICE = "/cellwright/robot/move"
"""Move joints, by index, to positions."""
PLACE_SERVICE = "/cellwright/robot/place"
"""Put joints, by index, at positions at once."""
MOVE_TIP_SERVICE = "/cellwright/robot/move_tip"
"""Move the tip of an arm, by its number, to a pose in the world."""
PLACE_BASE_SERVICE = "/cellwright/robot/place_base"
"""Put the root link at a pose at once."""


OWNER = "/assembled_robot"
"""Node name of the program in its robot's process, which ends when that node is gone."""

_START = "import sys; sys.path.insert(0, {!r}); from cellwright.running.remote.robot import main; sys.exit(main())"
_SOURCE_FOLDER = str(Path(__file__).resolve().parents[3])
_PIECE = 1 << 18
_TIMEOUT = 30.0  # [s] for an answer; the process answers between two steps of its physics
_TIME_TO_END = 3.0  # [s]
_NUMBERS = (1 << 32) - 1


class RobotProcess:
    """A robot's controller node in a process of its own.

    The process ends when this program ends for any reason, for then the connection closes. It ignores a Ctrl-C on the
    terminal. `ask` may be called from any thread. `python` is the interpreter of Cellwright's installation;
    `cellwright.running.remote.robot` reads the order.

    Raises:
        UsageError: the process cannot be started, or not with this robot; the text says why.
    """

    def __init__(self, python: str, order: Mapping[str, Any]) -> None:
        self._lock = threading.Lock()
        self._number = 0
        self._decoder = Decoder()
        self._frames: list[Frame] = []
        self._connection: socket.socket | None = None
        try:
            self._process = subprocess.Popen(  # noqa: S603
                [python, "-E", "-P", "-c", _START.format(_SOURCE_FOLDER)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                close_fds=True,
            )
        except OSError as error:
            raise UsageError(f"Cellwright's Python cannot be started: {python}: {error.strerror}") from None
        atexit.register(self.close)
        try:
            self.address = self._begin(order)
            self._connection = self._connect()
        except BaseException:
            self.close()
            raise

    @property
    def is_running(self) -> bool:
        """True while the robot can be reached."""
        return self._connection is not None and self._process.poll() is None

    def ask(self, service: str, **values: Any) -> dict[str, Any]:
        """Call a service with JSON values.

        Raises:
            CellwrightError: the service refuses, or the process has ended; the text says why.
        """
        with self._lock:
            self._number = self._number % _NUMBERS + 1
            payload = json.dumps(values).encode()
            answer = self._exchange(Frame(FrameKind.CALL, self._number, name=service, payload=payload))
        if answer.kind is FrameKind.REFUSED:
            raise CellwrightError(printable(answer.text()))
        return answer.json()

    def close(self) -> None:
        """End the process, and wait until it is gone."""
        atexit.unregister(self.close)
        connection, self._connection = self._connection, None
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()
        process = self._process
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()
        if connection is None:
            process.kill()  # it has no connection whose end would stop it
        try:
            process.wait(_TIME_TO_END)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _begin(self, order: Mapping[str, Any]) -> tuple[str, int]:
        """Send the order; return the address that the process answers with."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(OSError):  # it has ended, and has printed the reason
            self._process.stdin.write(json.dumps({**order, "parent": os.getpid()}, default=str).encode())
            self._process.stdin.close()
        line = self._process.stdout.readline()
        try:
            answer = json.loads(line)
        except ValueError:
            raise UsageError(f"the robot's process has ended with status {self._process.wait()}") from None
        if "error" in answer:
            raise UsageError(str(answer["error"]))
        return str(answer["host"]), int(answer["port"])

    def _connect(self) -> socket.socket:
        try:
            connection = socket.create_connection(self.address, timeout=_TIMEOUT)
        except OSError as error:
            raise UsageError(f"the robot's process cannot be reached: {error}") from None
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection = connection
        self._exchange(hello(OWNER, "cdr"))
        return connection

    def _exchange(self, frame: Frame) -> Frame:
        """Send a frame and wait for its answer."""
        connection = self._connection
        if connection is None:
            raise CellwrightError("the robot's process has ended")
        try:
            connection.sendall(frame.encode())
            while True:
                # an answer to a request that a Ctrl-C interrupted may still arrive; skip it
                while self._frames:
                    answer = self._frames.pop(0)
                    if answer.kind is FrameKind.ENDED:
                        raise CellwrightError(f"the robot's process has ended: {printable(answer.text())}")
                    if answer.number in (frame.number, 0):  # 0: a notice that the connection is cut
                        return answer
                data = connection.recv(_PIECE)
                if not data:
                    raise FrameError("it closed the connection")
                self._frames.extend(self._decoder.feed(data))
        except (OSError, FrameError) as error:
            self._connection = None
            connection.close()
            raise CellwrightError(f"the robot's process does not answer: {error}") from None
