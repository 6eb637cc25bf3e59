"""ROS's own robot_state_publisher as a child of the bridge: it computes the arm's frames from joint states."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, cast

from cellwright.middleware import wire as link
from cellwright.middleware.ros1.bridge.node import Master, MasterGoneError
from cellwright.middleware.wire.event_loop import EventLoop, report

NODE = "/robot_state_publisher"
PLACES = ("/usr/lib/robot_state_publisher", "/opt/ros/*/lib/robot_state_publisher")
HOW_TO_GET_IT = "ros-robot-state-publisher in Debian, ros-noetic-robot-state-publisher in Ubuntu"

_MAX_PAUSE = 30.0
_STAYED = 10.0
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_EXPECTED = re.compile(r"root link \S+ has an inertia")
"""Its harmless warning for every robot whose base has a mass."""


def find_state_publisher() -> str | None:
    """Return the path of the program; None if it is not installed."""
    prefixes = [prefix for prefix in os.environ.get("CMAKE_PREFIX_PATH", "").split(":") if prefix.startswith("/")]
    for root in (*PLACES, *(f"{prefix}/lib/robot_state_publisher" for prefix in prefixes)):
        for folder in sorted(Path("/").glob(root.lstrip("/"))):
            program = folder / "robot_state_publisher"
            if os.access(program, os.X_OK):
                return str(program)
    return shutil.which("robot_state_publisher")


class StatePublisher:
    """Child process of the program, started again when it ends; `source` is the topic of joint states."""

    def __init__(self, loop: EventLoop, program: str, source: str) -> None:
        self._loop = loop
        self._arguments = [program, f"__name:={NODE[1:]}", f"joint_states:={source}", "_publish_frequency:=50.0"]
        self._pause = 1.0
        self._text = b""
        self._is_stopping = False
        self._signs_off = False
        self._start()

    @property
    def is_alive(self) -> bool:
        """True if it runs."""
        return self._process.poll() is None

    def begin_to_stop(self) -> None:
        """Send it the signal to end; it then signs off at the master."""
        self._is_stopping = True
        if self.is_alive:
            self._signs_off = True
            self._process.send_signal(signal.SIGINT)

    def stop(self, timeout: float) -> None:
        """Wait for its end, and kill it after `timeout` [s]; remove what it leaves at the master.

        A signal while it registers may end it before it has signed off. If it ended earlier, another node may have the
        name.
        """
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._signs_off:
            with contextlib.suppress(MasterGoneError):
                Master(NODE).sign_off()

    def _start(self) -> None:
        if self._is_stopping:
            return
        watch = [str(Path(link.__file__).with_name("parent_watch.py")), str(os.getpid()), str(int(signal.SIGINT))]
        command = [sys.executable, "-I", "-S", *watch, *self._arguments]
        self._began = time.monotonic()
        # its name is absolute: namespaces of the shell, or of a group in a launch file, are for other nodes
        environment = {name: value for name, value in os.environ.items() if name != "ROS_NAMESPACE"}
        self._process: subprocess.Popen[bytes] = subprocess.Popen(  # noqa: S603 - a program found on this machine
            command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        self._pipe = cast("Any", self._process.stdout)
        os.set_blocking(self._pipe.fileno(), False)
        self._loop.watch(self._pipe, self._read)

    def _read(self) -> None:
        data = self._pipe.read1(1 << 16)
        if data is None:
            return
        *lines, self._text = (self._text + data).split(b"\n")
        for line in lines:
            text = _COLOURS.sub("", line.decode(errors="replace")).strip()
            if text and not _EXPECTED.search(text):
                report(f"robot_state_publisher: {text}")
        if not data:
            self._ended()

    def _ended(self) -> None:
        self._loop.forget(self._pipe)
        self._pipe.close()
        try:
            status = self._process.wait(1.0)
        except subprocess.TimeoutExpired:  # it has closed its output, and still runs: useless now
            self._process.kill()
            status = self._process.wait()
        if self._is_stopping:
            return
        stayed = time.monotonic() - self._began >= _STAYED
        self._pause = 1.0 if stayed else min(_MAX_PAUSE, 2 * self._pause)
        report(f"robot_state_publisher ended with status {status}; restarting it in {self._pause:g} s")
        self._loop.later(self._pause, self._start)
