"""What a socket between a cell and a program costs: round trips, many messages, pace, and lockstep.

Run with `python benchmarks/socket_latency.py [SECONDS]`; the pace is measured for so many seconds, 60 when left out.
"""

from __future__ import annotations

import json
import signal
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from fractions import Fraction

from cellwright.cell import Cell
from cellwright.client import ARM_JOINTS
from cellwright.client.transports.socket import SocketTransport
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.errors import RunEndedError
from cellwright.link.frames import Decoder, Frame, Kind, hello
from cellwright.messages.build import joint_trajectory, trajectory_point
from cellwright.messages.control_msgs import FollowJointTrajectoryActionGoal, FollowJointTrajectoryGoal
from cellwright.messages.osrf_gear import GetMaterialLocationsRequest
from cellwright.messages.standard import JointState
from cellwright.messages.types import message_type
from cellwright.server import Server

FOLLOW = "/ariac/arm/follow_joint_trajectory"
ROUNDS, TICKS = 500, 10_000


@contextmanager
def served(*options: str) -> Iterator[tuple[subprocess.Popen[str], tuple[str, int]]]:
    """The lesson's cell in a process of its own."""
    command = [sys.executable, "-m", "cellwright", "serve", "lesson", "--port", "0", "--json", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:  # noqa: S603
        assert process.stderr is not None
        host, _, port = process.stderr.readline().split()[3].rstrip(",").rpartition(":")
        try:
            yield process, (host, int(port))
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.communicate()


def times(action: Callable[[int], None]) -> str:
    """Median and 99th percentile of what an action takes."""
    found = []
    for index in range(ROUNDS):
        begin = time.perf_counter()
        action(index)
        found.append((time.perf_counter() - begin) * 1e3)
    return f"median {statistics.median(found):.3f} ms, p99 {statistics.quantiles(found, n=100)[98]:.3f} ms"


def round_trips() -> None:
    """Calls, commands, and a goal until its status is there, at a cell in real time."""
    with served() as (_, address):
        transport = SocketTransport(address, node="/bench")
        request = GetMaterialLocationsRequest(material_type="gear_part")
        print("service call               ", times(lambda _: transport.call("/ariac/material_locations", request)))
        point = trajectory_point((1.51, 0.0, -1.13, 3.14, 3.77, -1.51, 0.0), time_from_start=1_000_000_000)
        way = joint_trajectory(ARM_JOINTS, [point])
        print("command until answered     ", times(lambda _: transport.publish("/ariac/arm/command", way)))
        seen: list[str] = []
        transport.subscribe(
            f"{FOLLOW}/status",
            lambda message: seen.extend(each.goal_id.id for each in message.status_list),
        )

        def goal(index: int) -> None:
            said = goal_message(way, f"goal {index}")
            transport.publish(f"{FOLLOW}/goal", said)
            transport.advance(None, lambda: f"goal {index}" in seen)
            seen.clear()

        print("goal until its status comes", times(goal))
        transport.close()


def goal_message(way: object, name: str) -> object:
    """A goal of the arm's action."""
    moment = message_type("builtin_interfaces/Time")(sec=0, nanosec=0)  # type: ignore[call-arg]
    header = message_type("std_msgs/Header")(stamp=moment, frame_id="")  # type: ignore[call-arg]
    goal_id = message_type("actionlib_msgs/GoalID")(stamp=moment, id=name)  # type: ignore[call-arg]
    span = message_type("builtin_interfaces/Duration")(sec=0, nanosec=0)  # type: ignore[call-arg]
    goal = FollowJointTrajectoryGoal(way, [], [], span)  # type: ignore[arg-type]
    return FollowJointTrajectoryActionGoal(header, goal_id, goal)  # type: ignore[arg-type]


def fast_joint_states() -> None:
    """Joint states at 1 kHz: what a guest that listens costs, and whether it loses any."""
    alone, _ = ticks_with(None)
    for encoding in ("ros1", "cdr"):
        cost, heard = ticks_with(encoding)
        print(f"joint states at 1 kHz, {encoding:4}: {cost - alone:.0f} us a message, {TICKS - heard} of {TICKS} lost")


def ticks_with(encoding: str | None) -> tuple[float, int]:
    """Cost of a tick [us] with a listener in a process of its own, or without; how many messages it got."""
    trial = load_trial([find_trial("lesson")]).trial
    cell = Cell(replace(trial, settings=replace(trial.settings, timestep=(1, 1000))))
    server = Server(cell, port=0)
    states: list[JointState] = []
    first = cell.bus.subscribe("/ariac/joint_states", states.append)
    while not states:
        cell.step()
    first.cancel()
    fast = cell.bus.advertise("/bench/joint_states", "sensor_msgs/JointState", node="/gazebo")

    def say(_tick: int) -> None:
        fast.publish(replace(states[0]))  # another object: it is written anew, as one with new values would be

    cell.simulation.watch("fast", Fraction(1, 1000), say)
    process = None
    if encoding is not None:
        command = [sys.executable, __file__, "listen", *map(str, server.address), encoding]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)  # noqa: S603
        while fast.listeners == 0:
            server.wait(0.01)
    begin = time.perf_counter()
    for _ in range(TICKS):
        cell.step()
        server.wait(0.0)
    cost = (time.perf_counter() - begin) / TICKS * 1e6
    server.wait(0.2)
    server.close("measured")
    return cost, 0 if process is None else int(process.communicate(timeout=30)[0])


def listen(host: str, port: str, encoding: str) -> None:
    """Count joint states until the end, in a process of its own."""
    with socket.create_connection((host, int(port))) as connection:
        connection.sendall(hello("/listener", encoding).encode())
        connection.sendall(Frame(Kind.SUBSCRIBE, 1, "/bench/joint_states").encode())
        decoder, count = Decoder(), 0
        while data := connection.recv(1 << 18):
            count += sum(frame.kind is Kind.MESSAGE for frame in decoder.feed(data))
    print(count)


def pace(seconds: float) -> None:
    """How real time is kept, with a guest that listens to clock and joint states."""
    with served("--until", str(seconds)) as (process, address):
        transport = SocketTransport(address, node="/bench")
        transport.subscribe("/ariac/joint_states", lambda _: None)
        with suppress(RunEndedError):
            transport.advance(None)
        transport.close()
        found = json.loads(process.communicate()[0])["pace"]
    print(f"pace over {seconds:g} s: factor {found['factor']:.5f}, latest tick {found['worst_lateness'] * 1e3:.1f} ms")


def lockstep() -> None:
    """The lesson worked by kitter, in one process and in two."""
    for more in ([], ["--over", "socket", "--lockstep"]):
        command = [sys.executable, "-m", "cellwright", "run", "lesson", "--json", "--no-picture", *more]
        ran = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
        found = json.loads(ran.stdout)
        where = "in two processes, lockstep" if more else "in one process"
        print(f"kitter on the lesson {where}: {found['wall']:.1f} s, state hash {found['state_hash'][:8]}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["listen"]:
        listen(*sys.argv[2:])
    else:
        round_trips()
        fast_joint_states()
        lockstep()
        pace(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
