"""Driver of a Ray cluster: reads orders from stdin, makes a Ray task of each, and writes what comes of them to stdout.

It is a process of its own, since Ray ends its process when it loses the cluster, waits for minutes for one that does
not answer, and handles signals and stderr itself. The process ends when its stdin ends, and with it all its tasks.
"""

from __future__ import annotations

import io
import os
import re
import socket
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, NoReturn, TextIO

from cellwright.util.errors import one_line
from cellwright.util.files import write_atomic
from cellwright.util.process import json_lines, send_json, take_over_standard_streams

_CONNECT_TIMEOUT = 10.0  # [s]
_END_TIMEOUT = 5.0  # [s] that cancelled tasks may take to end
_EXIT_TIMEOUT = 30.0  # [s] after the end of stdin
_CPU_PERIOD = 2.0  # [s] between two looks at the cluster's size
_WORDS = {
    "WorkerCrashedError": "its worker process of Ray ended",
    "LocalRayletDiedError": "its node died",
    "NodeDiedError": "its node died",
    "OutOfMemoryError": "its node had no memory left",
}
"""Faults of the machine, by errors of Ray."""


def main() -> NoReturn:
    """Run the tasks of the orders from stdin, and exit."""
    raw, channel = take_over_standard_streams()
    orders = json_lines(io.BufferedReader(raw))  # type: ignore[type-var]  # a FileIO
    setup = next(orders)
    events: SimpleQueue[Any] = SimpleQueue()
    threading.Thread(target=_read, args=(orders, events), daemon=True).start()
    if problem := _connect(setup["address"], setup["excluded"]):
        send_json(channel, {"refused": problem})
    else:
        _Tasks(channel, events, Path(setup["folder"]), setup["starts"]).serve()
    os._exit(0)


def _read(orders: Iterable[Any], events: SimpleQueue[Any]) -> None:
    for order in orders:
        events.put(order)
    events.put(None)
    time.sleep(_EXIT_TIMEOUT)
    os._exit(1)


def _connect(address: str, excluded: list[str]) -> str:
    """Connect to the cluster, which gets a copy of the current folder; return why that is not possible."""
    import ray

    if place := re.fullmatch(r"(?:ray://)?([^:/]+):(\d+)", address):  # Ray itself would try for minutes
        try:
            socket.create_connection((place[1], int(place[2])), _CONNECT_TIMEOUT).close()
        except (OSError, OverflowError) as error:
            return f"cannot be reached: {getattr(error, 'strerror', None) or error}; start Ray there"
    copied = {"working_dir": str(Path.cwd()), "excludes": excluded}
    started: dict[str, Any] = {"include_dashboard": False} if address == "local" else {}
    try:
        ray.init(address, runtime_env=copied, log_to_driver=False, **started)
    except (Exception, SystemExit) as error:
        return one_line(error)
    return ""


class _Tasks:
    """The tasks of the evaluation.

    Args:
        events: orders from stdin; None at its end.
        folder: for the files of the runs.
        starts: of a run that a machine ends.
    """

    def __init__(self, channel: TextIO, events: SimpleQueue[Any], folder: Path, starts: int) -> None:
        import ray

        self._channel = channel
        self._events = events
        self._folder = folder
        self._task = ray.remote(num_cpus=1, max_retries=starts - 1, retry_exceptions=True)(_make_task())
        self._refs: dict[str, Any] = {}
        self._cpus = -1

    def serve(self) -> None:
        """Start tasks until stdin ends; then cancel them, and leave the cluster."""
        import ray

        looked = -_CPU_PERIOD
        while True:
            if time.monotonic() - looked >= _CPU_PERIOD:
                looked = time.monotonic()
                self._tell_cpus()
            with suppress(Empty):
                event = self._events.get(timeout=_CPU_PERIOD)
                if event is None:
                    break
                if callable(event):
                    event()
                else:
                    self._start(event)
        for ref in self._refs.values():
            ray.cancel(ref)
        if self._refs:
            ray.wait(list(self._refs.values()), num_returns=len(self._refs), timeout=_END_TIMEOUT, fetch_local=False)
        ray.shutdown()

    def _tell_cpus(self) -> None:
        import ray

        cpus = int(ray.cluster_resources().get("CPU", 0))
        if cpus != self._cpus:
            self._cpus = cpus
            send_json(self._channel, {"cpus": cpus})

    def _start(self, order: Mapping[str, Any]) -> None:
        key = order["key"]
        self._refs[key] = self._task.remote(order)
        # Ray calls back in a thread of its own. The queue brings the end of a task to the one thread that writes.
        future = self._refs[key].future()
        future.add_done_callback(lambda done: self._events.put(lambda: self._end(key, done)))

    def _end(self, key: str, done: Any) -> None:
        """Send what has come of an order, after its files are written."""
        from ray import exceptions

        del self._refs[key]
        content: dict[str, Any] = {"key": key}
        try:
            content |= done.result()
            for name, file in content.pop("files", {}).items():
                path = self._folder / name
                path.parent.mkdir(exist_ok=True)
                # a page may read the scene of another run
                write_atomic(path, file)
        except OSError as error:
            content["failure"] = f"{error.filename or self._folder}: {error.strerror or error}"
        except exceptions.RuntimeEnvSetupError as error:
            content["failure"] = f"a node could not get the current folder: {one_line(error)}"
        except exceptions.RayTaskError as error:
            content["fault"] = str(error.cause) if error.cause else one_line(error)
        except Exception as error:
            content["fault"] = _WORDS.get(type(error).__name__) or one_line(error)
        send_json(self._channel, {"ended": content})


def _make_task() -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Return the function of a task. As it is nested, Ray sends its code: a node without Cellwright can say so."""

    def work(order: Mapping[str, Any]) -> dict[str, Any]:
        import ray

        place = f"node {ray.util.get_node_ip_address()}"
        try:
            from cellwright.running.evaluation.execution.on_ray import node
        except ImportError as error:
            kind = "checked" if "check" in order else "failure"
            return {kind: f"{place}: {error}; install the same Cellwright on all nodes"}
        if "begins" in order:
            return {}
        done = node.check(**order["check"]) if "check" in order else node.work(order)
        for kind in ("failure", "checked"):
            if done.get(kind):
                done[kind] = f"{place}: {done[kind]}"
        return done

    return work
