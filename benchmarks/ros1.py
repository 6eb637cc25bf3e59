"""Cost of ROS 1: round trips through bridge and cell, compared with a bare pair of rospy nodes.

A cell of the trial `lesson` is stepped at 1 kHz in real time and echoes its commands. A rospy client measures the round
trip, and does the same with another rospy node, in turn.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from benchmarks.processes import ros1_environment
from benchmarks.ros1_clients import JOINTS, Clients
from benchmarks.timing import percentile
from cellwright.cell.cell import Cell
from cellwright.cell.devices.arm import Arm
from cellwright.cell.interface.parameters import parameters
from cellwright.cell.interface.rows import SIMULATOR
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.engine.rate_control import RealTimePacer
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.std_srvs import TriggerResponse
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.ros1.host.installation import find
from cellwright.middleware.server import Server
from cellwright.util.errors import ServiceFailedError, UsageError

SECONDS = 60.0
"""Minimum simulation time of a run [s]."""
CALLS, ROUNDS = 500, 3
"""Round trips in a measurement, and measurements."""
MESSAGES = {"50 Hz": 500, "1 kHz": 10_000}
TRIPS = {"topic": "a topic, there and back", "kept": "a service, open connection", "fresh": "a service, new connection"}
MAX_RATIO, MAX_EXTRA = 1.5, 0.2
"""Bound of a bridged round trip: this ratio to the bare one, plus this time [ms]."""


def bench_cell() -> Cell:
    """Return the lesson's cell at 1 kHz, which answers on three more names."""
    trial = load_trial([find_trial("lesson")]).trial
    cell = Cell(replace(trial, settings=replace(trial.settings, timestep=(1, 1000))), seed=1)
    pong = cell.bus.advertise("/bench/pong", "std_msgs/String", node="/gazebo")
    cell.bus.listen("/bench/ping", "std_msgs/String", lambda message, _node: pong.publish(message), node="/gazebo")
    cell.bus.serve("/bench/ask", "std_srvs/Trigger", lambda _request, _node: TriggerResponse(success=True))
    arm = cast("Arm", cell.arm)
    names = [f"joint_{number}" for number in range(7)]
    row = Endpoint(name=JOINTS["1 kHz"], type="sensor_msgs/JointState", about="", rate=Fraction(1000))

    def state() -> Message:
        return joint_state(names, *arm.read(), time=arm.simulation.now)

    Output(cell.bus, cell.simulation, row).sample(state)
    return cell


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Run the measuring clients beside the running cell.

    Raises:
        BenchmarkSkippedError: there is no ROS 1.
    """
    with ros1_environment() as environment:
        try:
            python = find(environment).python
        except UsageError as missing:
            raise BenchmarkSkippedError(str(missing)) from missing
        trips = ("kept",) if quick else tuple(TRIPS)
        messages = {"1 kHz": 20} if quick else MESSAGES
        on_progress("clients in rospy, beside a bare pair of nodes")
        clients = Clients(
            python,
            environment,
            Path(environment["ROS_HOME"]),
            trips=trips,
            calls=3 if quick else CALLS,
            rounds=1 if quick else ROUNDS,
            messages=messages,
        )
        yield from _bridged(clients, environment, 0.0 if quick else SECONDS)
    for trip in trips:
        yield from round_trip(TRIPS[trip], clients.figures[f"{trip} /bare"], clients.figures[f"{trip} /bench"])
    for rate in messages:
        lost, found = clients.figures[rate]
        yield Figure(f"joint states at {rate}: lost", lost, "messages", maximum=0.0)
        yield Figure(f"joint states at {rate}: rate", found, "Hz", note="in simulation time")


def _bridged(clients: Clients, environment: Mapping[str, str], seconds: float) -> Iterator[Figure]:
    """Run the bridged cell until the clients are done and `seconds` are over."""
    cell = bench_cell()
    server = Server(cell, port=0)
    with Ros1(lambda _line: None, environment=environment, identity=SIMULATOR) as ros:
        ros.prepare()
        begin = time.perf_counter()
        values: Any = parameters(cell.trial, competition=True)
        if not ros.join(server.address, values, server.wait):
            raise ServiceFailedError("the bridge is not ready")
        yield Figure("until the bridge is ready", time.perf_counter() - begin, "s")
        clients.start()
        if ros.bridge_pid is None:
            raise ServiceFailedError("the bridge has ended")
        processes = {"the cell": os.getpid(), "the bridge": ros.bridge_pid}
        before, start = {name: busy(pid) for name, pid in processes.items()}, time.perf_counter()
        pacer = RealTimePacer(cell.simulation, 1.0, sleep=server.wait)
        polled = 0.0
        while not clients.is_done or cell.simulation.time < seconds:
            pacer.step()
            if cell.simulation.time - polled > 0.1:
                polled = cell.simulation.time
                ros.poll()
        passed = time.perf_counter() - start
        shares = {name: (busy(pid) - before[name]) / passed * 100 for name, pid in processes.items()}
        server.close("measured")
    if clients.error:
        raise ServiceFailedError(f"a client in rospy failed: {clients.error}")
    late = f"{cell.simulation.time:.0f} s, the latest tick {pacer.max_lateness * 1e3:.1f} ms late"
    yield Figure("real time, bridged", pacer.factor, note=late)
    for name, share in shares.items():
        yield Figure(f"{name} at 1 kHz, busy", share, "% of a processor")


def round_trip(title: str, bare: Sequence[float], bridged: Sequence[float]) -> Iterator[Figure]:
    """Yield the figures of a round trip [s]."""
    for name, times in (("bare rospy", bare), ("through bridge and cell", bridged)):
        median = statistics.median(times) * 1e3
        maximum = None if times is bare else MAX_RATIO * statistics.median(bare) * 1e3 + MAX_EXTRA
        note = f"median; 99 % below {percentile(times, 99) * 1e3:.2f} ms"
        yield Figure(f"{title}: {name}", median, "ms", maximum=maximum, note=note)


def busy(pid: int) -> float:
    """Return the processor time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
