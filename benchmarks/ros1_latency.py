"""What ROS 1 costs: the way through bridge and cell, side by side with a bare pair of rospy nodes, in one run.

Run with `python benchmarks/ros1_latency.py [SECONDS]` on a machine that does nothing else. A cell of the trial `lesson`
is stepped at 1 kHz in real time and echoes what it is told; a rospy client measures the way there and back, and does
the same with another rospy node, in turn. Without ROS 1 it says so and measures nothing.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

from cellwright.cell import Cell
from cellwright.contracts.gear.parameters import parameters
from cellwright.contracts.sampling import Sampled
from cellwright.contracts.table import Row
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.devices.arm import Arm
from cellwright.errors import ServiceFailedError, UsageError
from cellwright.messages import Message
from cellwright.messages.build import joint_state
from cellwright.messages.std_srvs import TriggerResponse
from cellwright.ros1_host import Ros1
from cellwright.ros1_host.installation import find
from cellwright.server import Server
from cellwright.simulation.pacing import Pacer

SECONDS = 60.0
"""Simulation time of a run [s], at least."""
CALLS = 500
"""Round trips in a measurement."""
ROUNDS = 3
JOINTS = {"50 Hz": "/ariac/joint_states", "1 kHz": "/bench/joint_states"}

CLIENT = """
import json, os, sys, threading, time
import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

def main(what, name, count):
    rospy.init_node("client_" + what, anonymous=True, disable_rostime=True)
    return {"echo": echo, "topic": topic, "fresh": fresh, "kept": kept, "joints": joints}[what](name, int(count))

def echo(name, _count):
    pong = rospy.Publisher(name + "/pong", String, queue_size=10, tcp_nodelay=True)
    rospy.Subscriber(name + "/ping", String, pong.publish, tcp_nodelay=True)
    rospy.Service(name + "/ask", Trigger, lambda _: (True, ""))
    print("ready", flush=True)
    rospy.spin()
    os._exit(0)

def measured(call, count):
    call()
    times = []
    for number in range(count):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
        time.sleep(0.0013 + number % 7 * 0.0001)  # in step with nothing
    return times

def topic(name, count):
    heard = threading.Semaphore(0)
    rospy.Subscriber(name + "/pong", String, lambda _: heard.release(), tcp_nodelay=True)
    ping = rospy.Publisher(name + "/ping", String, queue_size=10, tcp_nodelay=True)
    while not ping.get_num_connections():
        time.sleep(0.01)
    while not heard.acquire(timeout=0.5):
        ping.publish("x")
    time.sleep(0.5)
    while heard.acquire(blocking=False):
        pass
    return measured(lambda: (ping.publish("x"), heard.acquire()), count)

def fresh(name, count):
    rospy.wait_for_service(name + "/ask")
    return measured(rospy.ServiceProxy(name + "/ask", Trigger), count)

def kept(name, count):
    rospy.wait_for_service(name + "/ask")
    return measured(rospy.ServiceProxy(name + "/ask", Trigger, persistent=True), count)

def joints(name, count):
    heard = []
    def hear(message):
        heard.append((message.header.seq, message.header.stamp.to_sec()))

    rospy.Subscriber(name, JointState, hear)
    while len(heard) < count:
        time.sleep(0.01)
    heard = heard[:count]
    return [heard[-1][0] - heard[0][0] + 1 - count, (count - 1) / (heard[-1][1] - heard[0][1])]

print(json.dumps(main(*sys.argv[1:])), flush=True)
"""


def bench_cell() -> Cell:
    """The lesson's cell at 1 kHz, which answers on three more names."""
    trial = load_trial([find_trial("lesson")]).trial
    cell = Cell(replace(trial, settings=replace(trial.settings, timestep=(1, 1000))), seed=1)
    pong = cell.bus.advertise("/bench/pong", "std_msgs/String", node="/gazebo")
    cell.bus.listen("/bench/ping", "std_msgs/String", lambda message, _node: pong.publish(message), node="/gazebo")
    cell.bus.serve("/bench/ask", "std_srvs/Trigger", lambda _request, _node: TriggerResponse(success=True))
    arm = cast("Arm", cell.arm)
    names = [f"joint_{number}" for number in range(7)]
    row = Row(template=JOINTS["1 kHz"], type="sensor_msgs/JointState", about="", rate=Fraction(1000))

    def state() -> Message:
        return joint_state(names, *arm.read(), time=arm.simulation.now)

    Sampled(cell.bus, cell.simulation, row, row.period, state)
    return cell


class Clients:
    """Runs the clients one after the other, in a thread of its own."""

    def __init__(self, python: str, environment: Mapping[str, str]) -> None:
        folder = tempfile.mkdtemp(prefix="cellwright-")
        self._command = [python, str(Path(folder, "client.py"))]
        self._environment = dict(environment)
        Path(self._command[1]).write_text(CLIENT, encoding="utf-8")
        self.figures: dict[str, list[float]] = {}
        self.error = ""
        self._thread = threading.Thread(target=self._run, daemon=True)

    @property
    def is_done(self) -> bool:
        """Whether all have run."""
        return not self._thread.is_alive()

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def _run(self) -> None:
        try:
            with self._start("echo", "/bare", 0) as echo:
                if echo.stdout is not None:
                    echo.stdout.readline()
                for _ in range(ROUNDS):
                    for what in ("topic", "kept", "fresh"):
                        for name in ("/bare", "/bench"):  # in turn, so that what else the machine does falls on both
                            self.figures.setdefault(f"{what} {name}", []).extend(self._ask(what, name, CALLS))
                echo.terminate()
            for rate, name in JOINTS.items():
                self.figures[rate] = self._ask("joints", name, 500 if rate == "50 Hz" else 10_000)
        except (subprocess.SubprocessError, ValueError, OSError) as error:
            self.error = str(error)

    def _start(self, what: str, name: str, count: int) -> subprocess.Popen[str]:
        command = [*self._command, what, name, str(count)]
        return subprocess.Popen(command, env=self._environment, stdout=subprocess.PIPE, text=True)  # noqa: S603

    def _ask(self, what: str, name: str, count: int) -> list[float]:
        with self._start(what, name, count) as client:
            said, _ = client.communicate(timeout=120.0)
        figures: list[float] = json.loads(said)
        return figures


def busy(pid: int) -> float:
    """Processor time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def bridge_of(pid: int) -> int:
    """The process id of the bridge that a process has started."""
    command = ["/bin/ps", "-o", "pid=,args=", "--ppid", str(pid)]
    listed = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    for line in listed.stdout.splitlines():
        number, _, program = line.strip().partition(" ")
        if "bridges/ros1" in program:
            return int(number)
    raise UsageError("there is no bridge")


def free_port() -> int:
    """A port that nobody listens at."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def show(figures: Mapping[str, list[float]]) -> None:
    """Print the table of times."""
    print("                          bare: median   p99     bridged: median   p99  [ms]   aim for the median")
    for what, title in (("topic", "topic, there and back"), ("kept", "service, connected"), ("fresh", "service, anew")):
        line = f"{title:24}"
        for name in ("/bare", "/bench"):
            times = sorted(figures[f"{what} {name}"])
            median, late = times[len(times) // 2] * 1e3, times[int(len(times) * 0.99)] * 1e3
            line += f"{median:14.3f} {late:7.3f}  "
            if name == "/bare":
                aim = 1.5 * median + 0.2
        print(f"{line}        {'met' if median <= aim else 'MISSED'}: {aim:.3f}")
    for rate in JOINTS:
        lost, found = figures[rate]
        print(f"joint states at {rate}: {lost:g} lost, {found:.3f} Hz in simulation time")


def main() -> None:
    """Measure and print."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    environment = {**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}", "ROS_IP": "127.0.0.1"}
    environment |= {"ROS_HOME": (home := tempfile.mkdtemp(prefix="cellwright-")), "ROS_LOG_DIR": home}
    try:
        python = find(environment).python
    except UsageError as error:
        print(f"skipped: {error}")
        return
    cell = bench_cell()
    server = Server(cell, port=0)
    clients = Clients(python, environment)
    with Ros1(print, environment=environment) as ros:
        ros.prepare()
        begin = time.perf_counter()
        told: Any = parameters(cell.trial, competition=True)
        if not ros.join(server.address, told, server.wait):
            raise ServiceFailedError("the bridge is not ready")
        print(f"bridge ready after {time.perf_counter() - begin:.2f} s; load {os.getloadavg()[0]:.2f}")
        clients.start()
        bridge = bridge_of(os.getpid())
        pacer = Pacer(cell.simulation, 1.0, sleep=server.wait)
        before = busy(os.getpid()), busy(bridge), time.perf_counter()
        polled = 0.0
        while not clients.is_done or cell.simulation.time < seconds:
            pacer.step()
            if cell.simulation.time - polled > 0.1:
                polled = cell.simulation.time
                ros.poll()
        factor, worst = pacer.factor, pacer.worst * 1e3
        passed = time.perf_counter() - before[2]
        used = [(busy(pid) - was) / passed * 100 for pid, was in ((os.getpid(), before[0]), (bridge, before[1]))]
        server.close("measured")
    if clients.error:
        print(f"a client failed: {clients.error}")
        sys.exit(1)
    show(clients.figures)
    print(f"pace over {cell.simulation.time:.0f} s: {factor:.5f} x real time, latest tick {worst:.1f} ms late")
    print(f"processor: cell {used[0]:.1f} %, bridge {used[1]:.1f} % of one core")


if __name__ == "__main__":
    main()
