"""Cost of ROS 2: round trips through bridge and cell, compared with a bare pair of rclpy nodes; messages that are lost.

A cell of the trial `lesson` is stepped at 1 kHz in real time and echoes its commands. A rclpy client measures the round
trip, and does the same with another rclpy node, in turn. Others count joint states at 1 kHz and the clock.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from benchmarks.ros1 import MAX_RATIO, bench_cell, busy
from benchmarks.timing import percentile
from cellwright.engine.rate_control import RealTimePacer
from cellwright.middleware.ros2.host import Ros2
from cellwright.middleware.ros2.host.installation import Installation, find
from cellwright.middleware.server import Server
from cellwright.util.errors import ServiceFailedError, UsageError

DOMAIN = "91"
CALLS, ROUNDS, SECONDS, LISTENERS = 300, 3, 60, 5
"""Round trips in a measurement, measurements; length of the stream of joint states [s], listeners of the clock."""
CLOCK_SECONDS = 10
TRIPS = {"topic": "a topic, there and back", "service": "a service"}

_CLIENT = Path(__file__).with_name("ros2_client.py")


class Clients(threading.Thread):
    """Runs measuring clients, one after the other; `figures` are their results, `error` says why one failed."""

    def __init__(self, found: Installation, environment: Mapping[str, str], *, quick: bool) -> None:
        super().__init__(name="clients", daemon=True)
        self._python, self._environment, self._quick = found.python, dict(environment), quick
        self.figures: dict[str, list[Any]] = {}
        self.error = ""
        self._bare = self._start("echo", "/bare", 0)
        assert self._bare.stdout is not None
        self._bare.stdout.readline()

    def _start(self, kind: str, name: str, number: float) -> subprocess.Popen[str]:
        return subprocess.Popen(  # noqa: S603
            [self._python, str(_CLIENT), kind, name, str(number)],
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self) -> None:
        """Measure."""
        try:
            for _ in range(1 if self._quick else ROUNDS):
                for kind in TRIPS:
                    for name in ("/bare", "/bench"):
                        self._measure(kind, name, 5 if self._quick else CALLS)
            self._measure("stream", "/bench/joint_states", 1 if self._quick else SECONDS)
            self._measure("stream", "/clock", 1 if self._quick else CLOCK_SECONDS, 1 if self._quick else LISTENERS)
        except (OSError, ValueError) as error:
            self.error = f"a client in rclpy failed: {error}"
        finally:
            self._bare.communicate("")

    def _measure(self, kind: str, name: str, number: float, clients: int = 1) -> None:
        running = [self._start(kind, name, number) for _ in range(clients)]
        for each in running:
            self.figures.setdefault(f"{kind} {name}", []).append(json.loads(each.communicate()[0]))


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Run the measuring clients beside the running cell.

    Raises:
        BenchmarkSkippedError: there is no ROS 2.
    """
    try:
        found = find()
    except UsageError as missing:
        raise BenchmarkSkippedError(str(missing)) from missing
    on_progress("clients in rclpy, beside a bare pair of nodes")
    environment = {**found.environment, "ROS_DOMAIN_ID": DOMAIN}
    cell = bench_cell()
    server = Server(cell, port=0)
    with Ros2(lambda _line: None, environment=environment) as ros:
        begin = time.perf_counter()
        if not ros.join(server.address, server.wait) or ros.bridge_pid is None:
            raise ServiceFailedError("the bridge is not ready")
        yield Figure("until the bridge is ready", time.perf_counter() - begin, "s")
        clients = Clients(found, {**environment, **ros.for_programs}, quick=quick)
        clients.start()
        processes = {"the cell": os.getpid(), "the bridge": ros.bridge_pid}
        before, start = {name: busy(pid) for name, pid in processes.items()}, time.perf_counter()
        pacer = RealTimePacer(cell.simulation, 1.0, sleep=server.wait)
        while clients.is_alive():
            pacer.step()
        passed = time.perf_counter() - start
        shares = {name: (busy(pid) - before[name]) / passed * 100 for name, pid in processes.items()}
        server.close("measured")
    if clients.error:
        raise ServiceFailedError(clients.error)
    for name, share in shares.items():
        yield Figure(f"{name} at 1 kHz, busy", share, "% of a processor")
    for kind, title in TRIPS.items():
        bare, bridged = (
            [time for times in clients.figures[f"{kind} {name}"] for time in times] for name in ("/bare", "/bench")
        )
        for label, times in (("bare rclpy", bare), ("through bridge and cell", bridged)):
            note = f"median; 99 % below {percentile(times, 99) * 1e3:.2f} ms"
            yield Figure(f"{title}: {label}", statistics.median(times) * 1e3, "ms", note=note)
        ratio = statistics.median(bridged) / statistics.median(bare)
        yield Figure(f"{title}: through bridge and cell / bare", ratio, maximum=MAX_RATIO)
    (joints,) = clients.figures["stream /bench/joint_states"]
    yield Figure(
        "joint states at 1 kHz: lost", joints["lost"], "messages", maximum=0.0, note=f"of {joints['received']}"
    )
    yield Figure("joint states at 1 kHz: rate", joints["rate"], "Hz", note="in simulation time")
    clocks = clients.figures["stream /clock"]
    lost = sum(each["lost"] for each in clocks)
    yield Figure("the clock, all listeners: lost", lost, "messages", maximum=0.0, note=f"{len(clocks)} listeners")
    yield Figure("the clock: rate", clocks[0]["rate"], "Hz", note="in simulation time")
