"""Cost of ROS 2: round trips through bridge and cell, compared with a bare pair of rclpy nodes; messages that are lost.

A cell of the trial `lesson` is stepped at 1 kHz in real time and echoes its commands. A rclpy client measures the round
trip, and does the same with another rclpy node, in turn. Others count joint states at 1 kHz, the clock, and pictures
with point clouds.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from benchmarks.ros1 import MAX_RATIO, bench_cell, busy
from benchmarks.timing import percentile
from cellwright.cell.cell import Cell
from cellwright.engine.rate_control import RealTimePacer
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import ALWAYS, publishes
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.control_msgs import (
    FollowJointTrajectoryActionGoal,
    FollowJointTrajectoryActionResult,
)
from cellwright.middleware.messages.conversions import header
from cellwright.middleware.messages.standard import GoalStatus, Image, PointCloud2, PointField
from cellwright.middleware.ros2.host import Ros2
from cellwright.middleware.ros2.host.installation import Installation, find
from cellwright.middleware.server import Server
from cellwright.util.errors import ServiceFailedError, UsageError

DOMAIN = "91"
CALLS, ROUNDS, SECONDS, LISTENERS = 300, 3, 60, 5
"""Round trips in a measurement, measurements; length of the stream of joint states [s], listeners of the clock."""
CLOCK_SECONDS = 10
PICTURE_SECONDS = 20
PATIENCE = 300.0
"""Time [s] for one measurement: a node of ROS may hang for good in its own library."""
FOLLOW = "/bench/follow"
PICTURES = {"/bench/image": ("sensor_msgs/Image", 30), "/bench/points": ("sensor_msgs/PointCloud2", 10)}
"""Type and rate [Hz] of each stream: pictures of 640 x 480, and clouds of 320 x 240 points with colours."""
TRIPS = {"topic": "a topic, there and back", "service": "a service", "action": "an action, from goal to result"}

_CLIENT = Path(__file__).with_name("ros2_client.py")


class Clients(threading.Thread):
    """Runs measuring clients, one after the other.

    `figures` are their results, `shares` how busy the bridge was during each stream [% of a processor], by its last
    name; `error` says why a client failed.
    """

    def __init__(self, found: Installation, environment: Mapping[str, str], bridge_pid: int, *, quick: bool) -> None:
        super().__init__(name="clients", daemon=True)
        self._bridge_pid = bridge_pid
        self.shares: dict[str, float] = {}
        self._python, self._environment, self._quick = found.python, dict(environment), quick
        self.figures: dict[str, list[Any]] = {}
        self.error = ""
        self._running: list[subprocess.Popen[str]] = []
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
                        self._measure(kind, 5 if self._quick else CALLS, name)
            self._measure("stream", 1 if self._quick else SECONDS, "/bench/joint_states")
            self._measure(
                "stream", 1 if self._quick else CLOCK_SECONDS, *["/clock"] * (1 if self._quick else LISTENERS)
            )
            self._measure("stream", 1 if self._quick else PICTURE_SECONDS, *PICTURES)
        except (OSError, ValueError, subprocess.TimeoutExpired) as error:
            self.error = f"a client in rclpy failed: {error}"
        finally:
            for each in self._running:
                each.kill()  # one that has ended takes no harm
            self._bare.communicate("")

    def _measure(self, kind: str, number: float, *names: str) -> None:
        """Run a client for each name, all at the same time."""
        before = busy(self._bridge_pid)
        self._running = [self._start(kind, name, number) for name in names]
        for name, each in zip(names, self._running, strict=True):
            printed = each.communicate(timeout=PATIENCE)[0]
            self.figures.setdefault(f"{kind} {name}", []).append(json.loads(printed))
        self.shares[names[-1]] = (busy(self._bridge_pid) - before) / number * 100


def _bench_cell() -> Cell:
    """Return the cell of ROS 1's benchmark with one more action, whose goals are reached at once, and with pictures.

    The pictures are not drawn: without a graphics card that would take longer than their way.
    """
    cell = bench_cell()
    cell.bus.actions[FOLLOW] = "control_msgs/FollowJointTrajectory"
    result = cell.bus.advertise(f"{FOLLOW}/result", "control_msgs/FollowJointTrajectoryActionResult", node="/gazebo")

    def follow(goal: FollowJointTrajectoryActionGoal, _node: str) -> None:
        result.publish(FollowJointTrajectoryActionResult(status=GoalStatus(goal.goal_id, GoalStatus.SUCCEEDED, "")))

    cell.bus.listen(f"{FOLLOW}/goal", "control_msgs/FollowJointTrajectoryActionGoal", follow, node="/gazebo")
    pixels, points = (np.arange(count).astype(np.uint8) for count in (640 * 480 * 3, 320 * 240 * 16))
    fields = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate(("x", "y", "z", "rgb"))]

    def image() -> Image:
        return Image(header("bench", cell.simulation.now), 480, 640, "rgb8", 0, 640 * 3, pixels)

    def cloud() -> PointCloud2:
        now = header("bench", cell.simulation.now)
        return PointCloud2(now, 240, 320, fields, False, 16, 320 * 16, points, False)

    builders: tuple[Callable[[], Message], ...] = image, cloud
    for (name, (kind, rate)), build in zip(PICTURES.items(), builders, strict=True):
        Output(cell.bus, cell.simulation, publishes(name, kind, rate, ALWAYS, "", node="/gazebo")).sample(build)
    return cell


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
    cell = _bench_cell()
    server = Server(cell, port=0)
    with Ros2(lambda _line: None, environment=environment) as ros:
        begin = time.perf_counter()
        if not ros.join(server.address, server.wait) or ros.bridge_pid is None:
            raise ServiceFailedError("the bridge is not ready")
        yield Figure("until the bridge is ready", time.perf_counter() - begin, "s")
        clients = Clients(found, {**environment, **ros.for_programs}, ros.bridge_pid, quick=quick)
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
    yield Figure("the clock: the bridge, busy", clients.shares["/clock"], "% of a processor")
    for name, (kind, rate) in PICTURES.items():
        title = "pictures of 640 x 480" if kind.endswith("Image") else "clouds of 320 x 240 points"
        (stream,) = clients.figures[f"stream {name}"]
        title = f"{title} at {rate} Hz"
        yield Figure(f"{title}: lost", stream["lost"], "messages", maximum=0.0, note=f"of {stream['received']}")
        yield Figure(f"{title}: rate", stream["rate"], "Hz", note="in simulation time")
    yield Figure("pictures and clouds: the bridge, busy", clients.shares["/bench/points"], "% of a processor")
