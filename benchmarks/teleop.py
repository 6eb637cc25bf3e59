"""Latency from a command to its motion: in one process, over the socket, and over ROS 1.

The QingLong's node runs in real time at 240 Hz. A `joint_cmd` at a random time turns its head a little, and the clock
stops at the first `joint_states` that shows the motion.

Most of the latency is inherent: the command waits for the next step (4.2 ms apart). Motion is published 100 times a
second, which at 240 steps a second is every second or third step. The latency from these causes alone is computed.
"""

from __future__ import annotations

import json
import math
import random
import statistics
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.benchmarks import Figure, OnProgress
from benchmarks.processes import ServerProcess, ros1_environment
from benchmarks.timing import percentile
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.config.robot.robots import load_robot
from cellwright.engine.rate_control import RealTimePacer
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.ros1.host.installation import find
from cellwright.robot.node import RobotNode
from cellwright.util.errors import UsageError

ROBOT, JOINT = "qinglong", "J_head_yaw"
TRIALS = 150
COMMAND, STATES = "/io_teleop/joint_cmd", "/io_teleop/joint_states"
STEP, MOVES = 0.05, 0.005
"""Size of the joint's motion [rad], and the speed from which it moves [rad/s]."""
REST, JITTER = 0.25, 0.02
"""Pause between two trials [s]: its minimum, and its random part."""

CLIENT = """
import json, random, sys, threading, time
import rospy
from sensor_msgs.msg import JointState

def main(joint, trials, step, moves, rest, jitter):
    rospy.init_node("bench", anonymous=True, disable_rostime=True)
    moved = threading.Event()
    def receive(message):
        if abs(message.velocity[message.name.index(joint)]) > moves:
            arrivals.append(time.perf_counter())
            moved.set()

    arrivals, found, sign = [], [], 1
    rospy.Subscriber("/io_teleop/joint_states", JointState, receive, tcp_nodelay=True)
    command = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=1, tcp_nodelay=True)
    while not command.get_num_connections():
        time.sleep(0.01)
    for number in range(trials + 1):
        time.sleep(rest + random.random() * jitter)
        arrivals.clear()
        moved.clear()
        begin = time.perf_counter()
        command.publish(JointState(name=[joint], position=[sign * step]))
        if not moved.wait(5.0):
            raise RuntimeError("no motion within 5 s of a command")
        found.append(arrivals[0] - begin)
        sign = -sign
    print(json.dumps(found[1:]))

main(sys.argv[1], int(sys.argv[2]), *map(float, sys.argv[3:]))
"""


def in_one_process(trials: int) -> tuple[list[float], list[float]]:
    """Return times until the target is applied, and until motion is published [s]; the node has its own thread."""
    node = RobotNode(load_robot(ROBOT, lambda _line: None))
    number, place = node.commander.numbers[JOINT], [joint.name for joint in node.config.robot.movable].index(JOINT)
    applied, moved, target, over = [0.0], threading.Event(), [0.0], threading.Event()
    arrivals: list[float] = []

    def check_target(_tick: int) -> None:
        if not applied[0] and node.commander.applied[number] == target[0]:
            applied[0] = time.perf_counter()

    def receive(message: Any) -> None:
        if applied[0] and abs(message.velocity[place]) > MOVES:  # before, it is the end of the previous motion
            arrivals.append(time.perf_counter())
            moved.set()

    def run() -> None:
        pacer = RealTimePacer(node.simulation, 1.0)
        while not over.is_set():
            pacer.step()

    node.simulation.watch("bench", None, check_target)
    node.bus.subscribe(STATES, receive)
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    ways: tuple[list[float], list[float]] = [], []
    for number_of_trial in range(trials):
        _rest()
        target[0], message = _command(number_of_trial)
        applied[0] = 0.0
        arrivals.clear()
        moved.clear()
        begin = time.perf_counter()
        node.simulation.inbox.put(lambda message=message: node.bus.publish(COMMAND, message))  # type: ignore[misc]
        if not moved.wait(5.0):
            raise UsageError("no motion within 5 s of a command")
        ways[0].append(applied[0] - begin)
        ways[1].append(arrivals[0] - begin)
    over.set()
    thread.join()
    return ways


def over_the_socket(trials: int) -> list[float]:
    """Return times until motion is published [s], to a client in this process, by a node in another."""
    with served() as robot:
        transport = SocketTransport(robot.address, node="/bench")
        place = [joint.name for joint in load_robot(ROBOT, lambda _line: None).robot.movable].index(JOINT)
        arrivals: list[float] = []

        def receive(message: Any) -> None:
            if abs(message.velocity[place]) > MOVES:
                arrivals.append(time.perf_counter())

        transport.subscribe(STATES, receive)
        found = []
        for number in range(trials):
            until = time.perf_counter() + REST
            transport.advance(None, lambda until=until: time.perf_counter() > until)  # type: ignore[misc]
            time.sleep(random.random() * JITTER)  # that was in step with the messages
            arrivals.clear()
            _, message = _command(number)
            begin = time.perf_counter()
            transport.publish(COMMAND, message)
            transport.advance(None, lambda: bool(arrivals))
            found.append(arrivals[0] - begin)
        transport.close()
    return found


def over_ros1(trials: int, python: str, environment: Mapping[str, str]) -> list[float]:
    """Return times until motion is published [s], to a rospy node."""
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder, served("--ros1", environment=environment):
        program = Path(folder, "client.py")
        program.write_text(CLIENT, encoding="utf-8")
        given = [JOINT, str(trials), *map(str, (STEP, MOVES, REST, JITTER))]
        ran = subprocess.run(  # noqa: S603
            [python, str(program), *given],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
            timeout=300.0,
        )
    times: list[float] = json.loads(ran.stdout)
    return times


def served(*options: str, environment: Mapping[str, str] | None = None) -> ServerProcess:
    """Start the robot's node in a process of its own."""
    return ServerProcess("teleop", ROBOT, "--port", "0", *options, environment=environment)


def sampling(trials: int = 20_000) -> tuple[list[float], list[float]]:
    """Return the computed waits [s] for the next step, and for the next message."""
    chance = random.Random(1)
    published = [-(-number * 240 // 100) for number in range(1, 102)]  # the steps that are followed by a message
    ways: tuple[list[float], list[float]] = [], []
    for _ in range(trials):
        moment = chance.random() * 240
        ways[0].append((int(moment) + 1 - moment) / 240)
        ways[1].append((next(step for step in published if step > moment) - moment) / 240)
    return ways


def _command(number: int) -> tuple[float, Any]:
    target = STEP if number % 2 == 0 else -STEP
    return target, joint_state([JOINT], [target], time=0)


def _rest() -> None:
    time.sleep(REST + random.random() * JITTER)


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Send commands over each transport."""
    trials = 3 if quick else TRIALS
    on_progress(f"{trials} commands in one process")
    applied, moved = sampling()
    yield figure("until a command is applied: wait for the step only", applied, "computed")
    here_applied, here_moved = in_one_process(trials)
    yield figure("until a command is applied: in one process", here_applied)
    yield figure("until motion is reported: wait for step and message only", moved, "computed")
    yield figure("until motion is reported: in one process", here_moved)
    on_progress(f"{trials} commands over the socket")
    yield figure("until motion is reported: over the socket", over_the_socket(trials))
    on_progress(f"{trials} commands over ROS 1")
    label = "until motion is reported: over ROS 1"
    with ros1_environment() as environment:
        try:
            python = find(environment).python
        except UsageError as missing:
            yield Figure(label, math.nan, "ms", note=f"skipped: {missing}")
            return
        yield figure(label, over_ros1(trials, python, environment))


def figure(label: str, times: Sequence[float], how: str = "measured") -> Figure:
    """Return the median of times [s]."""
    note = f"{how}; median, 99 % below {percentile(times, 99) * 1e3:.1f} ms"
    return Figure(label, statistics.median(times) * 1e3, "ms", note=note)
