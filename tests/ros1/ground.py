"""Separate ROS 1 environment: a master on a free port, with clients, tools and cells, all on loopback."""

from __future__ import annotations

import os
import signal
import sys
import xmlrpc.client
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, cast

import cellwright
from tests.ros1.client import Client, warm_ros
from tests.ros1.requirement import ros_python, system_path
from tests.support.ports import free_port
from tests.support.processes import Process, name_of
from tests.support.waiting import TIMEOUT, wait_until
from tests.support.warm import WarmStart, warm_start

_OURS = ("ROS", "PYTHON", "VIRTUAL_ENV", "CMAKE_PREFIX_PATH", "CELLWRIGHT", "ARIAC", "COLUMNS")


class Ground:
    """Environment of one master. `close` ends everything that was started here."""

    def __init__(self, folder: Path, messages: Path, *, roscore: bool = False) -> None:
        """Choose a port; nothing runs yet.

        Args:
            folder: for logs, programs and working folders.
            messages: folder of generated message modules.
            roscore: the master is a whole roscore, with rosout and parameters, not a bare rosmaster.

        The attribute `process` is the master, None where it does not run.
        """
        self.folder = folder
        self.port = free_port()
        self._messages = messages
        self._roscore = roscore
        self.process: Process | None = None
        self._started: list[Process] = []
        self._served: list[Process] = []

    @property
    def uri(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    @property
    def ros(self) -> dict[str, str]:
        """Environment variables that lead a program to this master."""
        home = self.folder / "ros"
        return {
            "ROS_MASTER_URI": self.uri,
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(home),
            "ROS_LOG_DIR": str(home / "log"),
            "ROS_PARALLEL_JOBS": f"-j{os.cpu_count()}",  # else `catkin_make` waits for the machine's load to fall
        }

    @property
    def environment(self) -> dict[str, str]:
        """Whole environment of a client: the generated messages, and nothing of this Python."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith(_OURS)}
        return {**kept, **self.ros, "PATH": system_path(), "PYTHONPATH": str(self._messages), "HOME": str(self.folder)}

    def ask(self, call: str, *arguments: Any) -> Any:
        """Return the master's value of an API call, as in `ask("getSystemState")`.

        Args:
            call: name of the call, such as "getPublishedTopics".
            arguments: of the call, after the caller's name.
        """
        with xmlrpc.client.ServerProxy(self.uri) as master:
            code, message, value = cast("tuple[int, str, Any]", getattr(master, call)("/test", *arguments))
        assert code == 1, f"{call}: {message}"
        return value

    def start_master(self) -> None:
        """Start the master, and wait until it answers. A restarted one keeps its port."""
        options = ["roscore", "-p"] if self._roscore else ["rosmaster", "--core", "-p"]
        self.process = self.start([*options, str(self.port)])
        wait_until(self._answers, f"answer of the master at {self.uri}")
        if self._roscore:
            wait_until(lambda: self.has_node("/rosout"), "rosout")

    def stop_master(self, number: int = signal.SIGINT) -> None:
        """End the master by a signal, and wait for its end."""
        assert self.process is not None
        self.process.signal(number)
        self.process.finish()
        self.process = None

    def start(self, command: list[str], *, folder: Path | None = None, **more: str) -> Process:
        """Start a system program, such as `rostopic hz /clock`. Python programs of ROS 1 are forked, see `Client`.

        Args:
            command: program and arguments.
            folder: working folder, by default a folder for tests.
            more: further variables of its environment.
        """
        python, whole = ros_python(), self._whole(command)
        is_text = len(whole) > 1 and whole[0] == python and not whole[1].startswith("-")
        return self._start(whole, folder, more, warm_ros() if is_text else None)

    def cold_start(self, command: list[str], *, folder: Path | None = None, **more: str) -> Process:
        """Start a system program, and an interpreter for it: for tests of its start. Arguments as of `start`."""
        return self._start(self._whole(command), folder, more, None)

    @staticmethod
    def _whole(command: list[str]) -> list[str]:
        """Return a command with the path of its program, behind its interpreter if that is the Python of ROS 1."""
        python, path = ros_python(), _found(command[0])
        return [*([python] if python is not None and _is_text_for(python, path) else []), path, *command[1:]]

    def _start(
        self, command: list[str], folder: Path | None, more: Mapping[str, str], warm: WarmStart | None
    ) -> Process:
        where = folder or self.folder / "work"
        where.mkdir(parents=True, exist_ok=True)
        process = Process(command, {**self.environment, **more}, where, warm=warm)
        self._started.append(process)
        return process

    def tool(self, *command: str, status: int = 0, **more: str) -> str:
        """Run a system program to its end; return its output.

        Args:
            command: program and arguments.
            status: the expected exit status.
            more: further variables of its environment.
        """
        process = self.start(list(command), folder=None, **more)
        ended = process.finish()
        assert ended == status, f"{command}: status {ended}\n{process.said}\n-- cells --\n{self.log()[-4000:]}"
        return process.out

    def client(self, program: str | Callable[..., object], *arguments: Any, **more: str) -> Client:
        """Start a client under the system's Python; see `Client`.

        Args:
            program: a function, or the text of a program.
            arguments: of it.
            more: further variables of its environment.
        """
        folder = self.folder / f"client{len(self._started)}"
        client = Client(program, arguments, {**self.environment, **more}, folder)
        self._started.append(client)
        return client

    def cellwright(self, *arguments: str, **more: str) -> Process:
        """Run the command `cellwright` with this master's variables, forked from a Python that has loaded it.

        Args:
            arguments: of the command.
            more: further variables of its environment.
        """
        return self._cellwright(arguments, more, warm_start())

    def cold_cellwright(self, *arguments: str, **more: str) -> Process:
        """Start an interpreter for the command `cellwright`: for tests of its start. Arguments as of `cellwright`."""
        return self._cellwright(arguments, more, None)

    def _cellwright(self, arguments: Sequence[str], more: Mapping[str, str], warm: WarmStart | None) -> Process:
        where = self.folder / "cell"
        where.mkdir(parents=True, exist_ok=True)
        source = str(Path(cellwright.__file__).parents[1])  # the tested package, even if another one is installed
        environment = {
            **os.environ,
            **self.ros,
            "HOME": str(self.folder),
            "PYTHONPATH": source,
            "COLUMNS": "120",
            **more,
        }
        process = Process([sys.executable, "-m", "cellwright", *arguments], environment, where, warm=warm)
        self._started.append(process)
        self._served.append(process)
        return process

    def serve(self, trial: str, *options: str, **more: str) -> Process:
        """Start `cellwright serve … --ros1`, and wait until it reports that it is ready.

        Args:
            trial: name or file.
            options: of the command.
            more: further variables of its environment.
        """
        cell = self.cellwright("serve", trial, "--ros1", "--port", "0", *options, **more)
        cell.wait_for("^ready")
        return cell

    def teleop(self, robot: str, *options: str, **more: str) -> Process:
        """Start `cellwright teleop … --ros1`, and wait until it reports that it is ready.

        Args:
            robot: name or file.
            options: of the command.
            more: further variables of its environment.
        """
        node = self.cellwright("teleop", robot, "--ros1", "--port", "0", *options, **more)
        node.wait_for("^ready")
        return node

    def log(self) -> str:
        """Output of the cells so far, on both streams, in the order of arrival."""
        return "".join(cell.said for cell in self._served)

    def close(self) -> None:
        """End everything. A cell must end in time and cleanly, and leave nothing behind."""
        try:
            for cell in self._served:
                check_end(cell)
        finally:
            for process in reversed(self._started):
                process.kill()

    def _answers(self) -> bool:
        assert self.process is not None
        try:
            pid = self.ask("getPid")
        except OSError:
            assert self.process.running, f"the master has ended:\n{self.process.out}\n{self.process.err}"
            return False
        # If another program took the port first, another master would answer.
        assert self._roscore or pid == self.process.pid
        return True

    def has_node(self, node: str) -> bool:
        """True if a node of this name is registered with the master."""
        return any(node in nodes for role in self.ask("getSystemState") for _, nodes in role)


def check_end(cell: Process, timeout: float = TIMEOUT, *, children: float = TIMEOUT) -> None:
    """End a cell as Ctrl-C does, and check its end: status 0, no traceback, nothing left behind.

    Args:
        cell: may have ended before.
        timeout: limit of its end [s].
        children: limit of the end of its own processes [s].
    """
    was_running = cell.running
    status = cell.interrupt(timeout)
    said = f"\n-- out --\n{cell.out[-4000:]}\n-- err --\n{cell.err[-4000:]}"
    assert "Traceback" not in cell.out + cell.err, said
    if was_running:
        assert status == 0, f"status {status}{said}"
    try:
        wait_until(lambda: not cell.relatives(), "end of all processes", timeout=children)
    except AssertionError:
        raise AssertionError(f"left behind: {[name_of(pid) for pid in cell.relatives()]}{said}") from None


@contextmanager
def ground(folder: Path, messages: Path, *, roscore: bool = False, master: bool = True) -> Iterator[Ground]:
    """Provide a ground within a block; for fixtures that several tests share.

    Args:
        folder: for its files.
        messages: folder of generated message modules.
        roscore: a whole roscore, not a bare rosmaster.
        master: start it; else only reserve a port, without a master.
    """
    made = Ground(folder, messages, roscore=roscore)
    try:
        if master:
            made.start_master()
        yield made
    finally:
        made.close()


def _found(program: str) -> str:
    """Return the path of a system program; this process's search path may begin with another Python's."""
    for folder in system_path().split(":"):
        if os.access(path := Path(folder, program), os.X_OK):
            return str(path)
    raise AssertionError(f"no program {program}")


@cache
def _is_text_for(python: str, program: str) -> bool:
    """True if a program is a script of this interpreter."""
    with open(program, "rb") as file:
        return file.readline(200).split() == [f"#!{python}".encode()]
