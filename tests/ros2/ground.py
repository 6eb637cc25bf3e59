"""Separate ROS 2 environment: a domain of its own on loopback, with clients and cells."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cellwright
from cellwright.middleware.ros2.host.installation import Installation
from cellwright.middleware.ros2.host.ros2 import discovery_variables
from tests.ros1.client import function_result, function_text
from tests.ros2.domains import TakenDomain
from tests.ros2.requirement import installation
from tests.support.processes import Process, name_of
from tests.support.waiting import wait_until
from tests.support.warm import warm_start

_PROGRAMS = Path(__file__).parent / "programs"
_OURS = ("ROS", "PYTHON", "VIRTUAL_ENV", "AMENT", "CMAKE_PREFIX_PATH", "CELLWRIGHT", "ARIAC", "COLUMNS")


class Client(Process):
    """Running program under the Python of ROS 2: a function that imports everything in its own body."""

    def __init__(
        self,
        python: str,
        function: Callable[..., object],
        arguments: tuple[Any, ...],
        environment: dict[str, str],
        folder: Path,
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{function.__name__}.py"
        path.write_text(function_text(function))
        super().__init__([python, str(path), json.dumps(arguments)], environment, folder)

    def value(self) -> Any:
        """Return the function's result, through JSON; a traceback of the client fails the test."""
        return function_result(self)


class Ground:
    """Environment of one domain. `close` ends everything that was started here."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._taken = TakenDomain()
        self.domain = self._taken.number
        self._started: list[Process] = []

    @property
    def ros(self) -> dict[str, str]:
        """Environment variables that lead a program to this domain."""
        found = installation()
        assert found is not None
        return {
            **discovery_variables(found.distribution, "localhost"),
            "ROS_DOMAIN_ID": str(self.domain),
            "ROS_LOG_DIR": str(self.folder / "log"),
        }

    @property
    def environment(self) -> dict[str, str]:
        """Whole environment of a client; wrong types of fields are errors there."""
        found = installation()
        assert found is not None
        return self.environment_of(found)

    def environment_of(self, found: Installation) -> dict[str, str]:
        """Return the same of a client under a certain installation."""
        return {
            **found.environment,
            **self.ros,
            "ROS_PYTHON_CHECK_FIELDS": "1",
            "PYTHONPATH": os.pathsep.join(filter(None, [str(_PROGRAMS), found.environment.get("PYTHONPATH", "")])),
            "HOME": str(self.folder),
        }

    def client(self, function: Callable[..., object], *arguments: Any, under: Installation | None = None) -> Client:
        """Start a function under the Python of ROS 2; it imports all that it uses, and `rclpy_node` for a node.

        Args:
            function: to start.
            arguments: of the function, as JSON values.
            under: the installation; None for that of the cell.
        """
        found = under or installation()
        assert found is not None
        folder = self.folder / f"client{len(self._started)}"
        client = Client(found.python, function, arguments, self.environment_of(found), folder)
        self._started.append(client)
        return client

    def cellwright(self, *arguments: str, **more: str) -> Process:
        """Run the command `cellwright` in this domain, forked from a Python that has loaded it."""
        where = self.folder / "cell"
        where.mkdir(parents=True, exist_ok=True)
        source = str(Path(cellwright.__file__).parents[1])
        environment = {**os.environ, **self.ros, "PYTHONPATH": source, "COLUMNS": "120", **more}
        environment.setdefault("CELLWRIGHT_ROS2_PYTHON", installation().python)  # type: ignore[union-attr]
        process = Process([sys.executable, "-m", "cellwright", *arguments], environment, where, warm=warm_start())
        self._started.append(process)
        return process

    def serve(self, trial: str, *options: str, **more: str) -> Process:
        """Start `cellwright serve … --ros2`, and wait until it reports that it is ready."""
        return self.ready("serve", trial, *options, **more)

    def teleop(self, robot: str, *options: str, **more: str) -> Process:
        """Start `cellwright teleop … --ros2`, and wait until it reports that it is ready."""
        return self.ready("teleop", robot, *options, **more)

    def ready(self, command: str, *arguments: str, **more: str) -> Process:
        """Start a command with `--ros2`, and wait until it reports that it is ready."""
        name, *options = arguments
        process = self.cellwright(command, name, "--ros2", "--port", "0", *options, **more)
        process.wait_for("^ready")
        return process

    def stop(self, process: Process, number: int = signal.SIGINT) -> str:
        """End a process by a signal; return its output."""
        process.signal(number)
        process.finish()
        return process.said

    def close(self) -> None:
        """End what still runs."""
        try:
            for process in reversed(self._started):
                if process.running:
                    process.signal(signal.SIGINT)  # a killed node stays in the graph of its domain for 20 s
                    process.finish()
        finally:
            self._taken.give_back()


def bridge_pid(cell: Process) -> int:
    """Return the process id of a cell's bridge."""
    return wait_until(
        lambda: next((pid for pid in cell.relatives() if "ros2/bridge/bridge.py" in name_of(pid)), 0), "bridge"
    )


@contextmanager
def ground(folder: Path) -> Iterator[Ground]:
    """Make a domain for tests."""
    made = Ground(folder)
    try:
        yield made
    finally:
        made.close()
