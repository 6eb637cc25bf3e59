"""Cost of a socket between a cell and a program: round trips, many messages, pace, and lockstep."""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction

from benchmarks.benchmarks import Figure, OnProgress
from benchmarks.listener import listening
from benchmarks.processes import ServerProcess
from benchmarks.timing import percentile
from cellwright.cell.cell import Cell
from cellwright.clients.client import ARM_JOINTS
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.control_msgs import FollowJointTrajectoryActionGoal, FollowJointTrajectoryGoal
from cellwright.middleware.messages.conversions import joint_trajectory, trajectory_point
from cellwright.middleware.messages.osrf_gear import GetMaterialLocationsRequest
from cellwright.middleware.messages.standard import JointState
from cellwright.middleware.server import Server
from cellwright.util.errors import RunEndedError

FOLLOW = "/ariac/arm/follow_joint_trajectory"
JOINTS = "/bench/joint_states"
ENCODINGS = ("ros1", "cdr")
ROUNDS, TICKS, SECONDS = 500, 10_000, 60.0


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Take all figures."""
    on_progress("round trips")
    yield from round_trips(5 if quick else ROUNDS)
    on_progress("joint states at 1 kHz")
    yield from fast_joint_states(200 if quick else TICKS, ENCODINGS[:1] if quick else ENCODINGS)
    on_progress("the lesson worked in one process and in two")
    yield from lockstep(1.0 if quick else math.inf)
    seconds = 0.3 if quick else SECONDS
    on_progress(f"pace, for {seconds:g} s")
    yield from pace(seconds)


def round_trips(rounds: int) -> Iterator[Figure]:
    """Yield figures of calls, commands, and a goal until its status arrives, at a cell in real time."""
    with ServerProcess("serve", "lesson", "--port", "0") as served:
        transport = SocketTransport(served.address, node="/bench")
        request = GetMaterialLocationsRequest(material_type="gear_part")
        yield times("a service call", rounds, lambda _: transport.call("/ariac/material_locations", request))
        point = trajectory_point((1.51, 0.0, -1.13, 3.14, 3.77, -1.51, 0.0), time_from_start=1_000_000_000)
        way = joint_trajectory(ARM_JOINTS, [point])
        yield times("a command, until it is answered", rounds, lambda _: transport.publish("/ariac/arm/command", way))
        seen: list[str] = []
        transport.subscribe(
            f"{FOLLOW}/status", lambda message: seen.extend(each.goal_id.id for each in message.status_list)
        )

        def goal(index: int) -> None:
            message = goal_message(way, f"goal {index}")
            transport.publish(f"{FOLLOW}/goal", message)
            transport.advance(None, lambda: f"goal {index}" in seen)
            seen.clear()

        yield times("a goal, until its status comes", rounds, goal)
        transport.close()


def times(label: str, rounds: int, action: Callable[[int], None]) -> Figure:
    """Return the median duration of an action."""
    found = []
    for index in range(rounds):
        begin = time.perf_counter()
        action(index)
        found.append((time.perf_counter() - begin) * 1e3)
    return Figure(label, statistics.median(found), "ms", note=f"median; 99 % below {percentile(found, 99):.2f} ms")


def goal_message(way: object, name: str) -> FollowJointTrajectoryActionGoal:
    """Return a goal of the arm's action."""
    moment = TYPES.message("builtin_interfaces/Time")(sec=0, nanosec=0)  # type: ignore[call-arg]
    header = TYPES.message("std_msgs/Header")(stamp=moment, frame_id="")  # type: ignore[call-arg]
    goal_id = TYPES.message("actionlib_msgs/GoalID")(stamp=moment, id=name)  # type: ignore[call-arg]
    span = TYPES.message("builtin_interfaces/Duration")(sec=0, nanosec=0)  # type: ignore[call-arg]
    goal = FollowJointTrajectoryGoal(way, [], [], span)  # type: ignore[arg-type]
    return FollowJointTrajectoryActionGoal(header, goal_id, goal)  # type: ignore[arg-type]


def fast_joint_states(ticks: int, encodings: Sequence[str]) -> Iterator[Figure]:
    """Yield figures of joint states at 1 kHz: the cost of a listening client, and its losses."""
    alone, _ = ticks_with(None, ticks)
    for encoding in encodings:
        cost, received = ticks_with(encoding, ticks)
        yield Figure(f"joint states in the form of {encoding}: cost", cost - alone, "us/message")
        yield Figure(f"joint states in the form of {encoding}: lost", ticks - received, f"of {ticks}", maximum=0.0)


def ticks_with(encoding: str | None, ticks: int) -> tuple[float, int]:
    """Return the cost of a tick [us] with a listener in a process of its own, or without; and its message count."""
    trial = load_trial([find_trial("lesson")]).trial
    cell = Cell(replace(trial, settings=replace(trial.settings, timestep=(1, 1000))))
    server = Server(cell, port=0)
    states: list[JointState] = []
    first = cell.bus.subscribe("/ariac/joint_states", states.append)
    while not states:
        cell.step()
    first.cancel()
    fast = cell.bus.advertise(JOINTS, "sensor_msgs/JointState", node="/gazebo")

    def publish(_tick: int) -> None:
        fast.publish(replace(states[0]))  # another object: it is encoded again, as one with new values would be

    cell.simulation.watch("fast", Fraction(1, 1000), publish)
    process = None if encoding is None else listening(server.address, JOINTS, encoding)
    if process is not None:
        while fast.listeners == 0:
            server.wait(0.01)
    begin = time.perf_counter()
    for _ in range(ticks):
        cell.step()
        server.wait(0.0)
    cost = (time.perf_counter() - begin) / ticks * 1e6
    server.wait(0.2)
    server.close("measured")
    return cost, 0 if process is None else int(process.communicate(timeout=30)[0])


def pace(seconds: float) -> Iterator[Figure]:
    """Yield figures of the real-time pace, with a client that listens to clock and joint states."""
    with ServerProcess("serve", "lesson", "--port", "0", "--json", "--until", str(seconds)) as served:
        transport = SocketTransport(served.address, node="/bench")
        transport.subscribe("/ariac/joint_states", lambda _: None)
        with suppress(RunEndedError):
            transport.advance(None)
        transport.close()
        found = served.result()["pace"]
    late = found["worst_lateness"] * 1e3
    yield Figure(
        "real time, with a subscriber", found["factor"], note=f"{seconds:g} s, the latest tick {late:.1f} ms late"
    )


def lockstep(until: float) -> Iterator[Figure]:
    """Yield figures of the lesson worked by the bundled agent, in one process and in two."""
    walls, hashes = [], set()
    limit = [] if math.isinf(until) else ["--until", str(until)]
    for more in ([], ["--over", "socket", "--lockstep"]):
        command = [sys.executable, "-m", "cellwright", "run", "lesson", "--json", "--no-picture", *limit, *more]
        ran = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
        found = json.loads(ran.stdout)
        walls.append(found["wall"])
        hashes.add(found["state_hash"])
    note = f"{walls[1]:.1f} s and {walls[0]:.1f} s"
    yield Figure("the agent over a socket in lockstep / in one process", walls[1] / walls[0], note=note)
    yield Figure("different end states of the two", len(hashes), "", maximum=1)
