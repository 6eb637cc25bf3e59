"""Child processes of Cellwright, forked from a process that has loaded their modules.

In a test, the start of the interpreter takes most of the processor time of such a process. Each fixture replaces it in
one place of Cellwright, for processes that the process of the tests starts. Tests of the start itself, of loaded
modules, and of the end with the parent do not use them.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import IO, Any

import pytest

from cellwright.running.evaluation.execution.process import worker_server
from cellwright.running.remote.fork_server import ForkedProcess, ForkServer
from tests.support.warm import WarmProcess, WarmStart, warm_start

_PAGE = (
    "cellwright.viewer.web.operator.feature",
    "cellwright.viewer.web.page",
    "cellwright.viewer.web.cell_panels",
    "cellwright.viewer.web.time_controls",
    "cellwright.viewer.web.scene",
    "cellwright.viewer.web.overlays",
    "cellwright.viewer.web.views",
)
"""Modules of a page's process; they import the others. The program itself is run, and is not among them."""


class Subprocess:
    """Stand-in for the module `subprocess` in one module of Cellwright.

    Args:
        start: the warm start, for the environment of the first program.
    """

    DEVNULL, PIPE, STDOUT = subprocess.DEVNULL, subprocess.PIPE, subprocess.STDOUT
    TimeoutExpired = subprocess.TimeoutExpired

    def __init__(self, start: Callable[[Mapping[str, str]], WarmStart]) -> None:
        self._start = start

    def Popen(
        self,
        command: Sequence[str],
        *,
        stdin: int | None = None,
        stderr: IO[bytes] | int | None = None,
        env: Mapping[str, str] | None = None,
        text: bool = False,
        **_: object,
    ) -> WarmProcess:
        """Fork a program. Its standard error is that of this process unless redirected."""
        environment = {**os.environ} if env is None else env
        if Path(command[1]).name == "parent_watch.py":  # its parent would be another process
            command = command[4:]
        elif len(command) > 3 and Path(command[3]).name == "guard.py":  # it starts its program
            command = command[6:]
        with ExitStack() as stack:
            return self._start(environment).popen(
                command,
                folder=Path.cwd(),
                environment=environment,
                stdin=stdin == subprocess.PIPE,
                stderr=stack.enter_context(os.fdopen(os.dup(2), "wb")) if stderr is None else stderr,
                text=text,
            )


def _replace(patch: pytest.MonkeyPatch, module: str, start: Callable[[Mapping[str, str]], WarmStart]) -> None:
    if sys.platform != "win32":
        patch.setattr(f"{module}.subprocess", Subprocess(start))


def _replace_child(patch: pytest.MonkeyPatch, child: str, start: Callable[[Mapping[str, str]], WarmStart]) -> None:
    if sys.platform != "win32":
        patch.setattr(f"cellwright.{child}._popen", staticmethod(Subprocess(start).Popen))


@pytest.fixture
def quick_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork pages."""
    _replace_child(monkeypatch, "viewer.web.start.WebPage", lambda _: warm_start("page", lambda: WarmStart(_PAGE)))


@pytest.fixture
def quick_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork render processes; each loads the graphics library itself."""
    _replace_child(monkeypatch, "rendering.worker.client.RenderWorker", lambda _: warm_start())


@pytest.fixture
def quick_agents(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork agents."""
    _replace_child(monkeypatch, "running.remote.hosting.AgentProcess", lambda _: warm_start())


class SharedServer:
    """Fork server of workers for one evaluation, which leaves the real one to the next."""

    is_running = True

    def __init__(self, server: ForkServer) -> None:
        self._server = server

    def popen(self, command: Sequence[str], **options: Any) -> ForkedProcess:
        """Fork a program."""
        return self._server.popen(command, **options)

    def close(self) -> None:
        """Let the server run."""


@pytest.fixture(scope="session")
def shared_workers() -> Iterator[ForkServer | None]:
    """Yield one fork server of workers for all tests."""
    server = worker_server()
    yield server
    if server is not None:
        server.close()


@pytest.fixture
def quick_workers(monkeypatch: pytest.MonkeyPatch, quick_drawing: None, shared_workers: ForkServer | None) -> None:
    """Fork workers of all evaluations from one server, and the process that draws for their report.

    Tests of a worker's leftovers, and of equal results, do not use this.
    """
    if shared_workers is not None:
        place = "cellwright.running.evaluation.execution.local.worker_server"
        monkeypatch.setattr(place, partial(SharedServer, shared_workers))


@pytest.fixture
def quick_trackers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork trackers of evaluations, whose packages take seconds to load."""

    def start(environment: Mapping[str, str]) -> WarmStart:
        modules = ("cellwright.running.evaluation.outputs.trackers", "mlflow", "wandb")
        return warm_start("tracker of an evaluation", lambda: WarmStart(modules, environment=environment))

    _replace_child(monkeypatch, "running.evaluation.outputs.tracking.TrackerProcess", start)


@pytest.fixture
def quick_serving(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork the serving commands of benchmarks."""
    _replace(monkeypatch, "benchmarks.processes", lambda _: warm_start())


QUICK_PAGES = pytest.mark.usefixtures("quick_pages")
QUICK_DRAWING = pytest.mark.usefixtures("quick_drawing")
QUICK_AGENTS = pytest.mark.usefixtures("quick_agents")
QUICK_SERVING = pytest.mark.usefixtures("quick_serving")
QUICK_TRACKERS = pytest.mark.usefixtures("quick_trackers")
QUICK_WORKERS = pytest.mark.usefixtures("quick_workers")
