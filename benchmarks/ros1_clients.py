"""Measuring clients in rospy: each in a process of its own, one after the other."""

from __future__ import annotations

import json
import subprocess
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

LIMIT = 120.0
"""Time [s] after which a client has failed."""

JOINTS = {"50 Hz": "/ariac/joint_states", "1 kHz": "/bench/joint_states"}

CLIENT = """
import json, os, sys, threading, time
import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

def main(kind, name, count):
    rospy.init_node("client_" + kind, anonymous=True, disable_rostime=True)
    return {"echo": echo, "topic": topic, "fresh": fresh, "kept": kept, "joints": joints}[kind](name, int(count))

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
    received = threading.Semaphore(0)
    rospy.Subscriber(name + "/pong", String, lambda _: received.release(), tcp_nodelay=True)
    ping = rospy.Publisher(name + "/ping", String, queue_size=10, tcp_nodelay=True)
    while not ping.get_num_connections():
        time.sleep(0.01)
    while not received.acquire(timeout=0.5):
        ping.publish("x")
    time.sleep(0.5)
    while received.acquire(blocking=False):
        pass
    return measured(lambda: (ping.publish("x"), received.acquire()), count)

def fresh(name, count):
    rospy.wait_for_service(name + "/ask")
    return measured(rospy.ServiceProxy(name + "/ask", Trigger), count)

def kept(name, count):
    rospy.wait_for_service(name + "/ask")
    return measured(rospy.ServiceProxy(name + "/ask", Trigger, persistent=True), count)

def joints(name, count):
    received = []
    def receive(message):
        received.append((message.header.seq, message.header.stamp.to_sec()))

    rospy.Subscriber(name, JointState, receive)
    while len(received) < count:
        time.sleep(0.01)
    received = received[:count]
    return [received[-1][0] - received[0][0] + 1 - count, (count - 1) / (received[-1][1] - received[0][1])]

print(json.dumps(main(*sys.argv[1:])), flush=True)
"""


class Clients:
    """Runs the clients one after the other, in a thread of its own.

    Args:
        python: an interpreter that has rospy.
        environment: of the clients.
        folder: for the clients' program.
        trips: the round trips: topic, kept, fresh.
        calls: round trips in a measurement.
        rounds: number of measurements of each.
        messages: number of counted joint states, by rate.
    """

    def __init__(
        self,
        python: str,
        environment: Mapping[str, str],
        folder: Path,
        *,
        trips: Sequence[str],
        calls: int,
        rounds: int,
        messages: Mapping[str, int],
    ) -> None:
        self._trips, self._calls, self._rounds, self._messages = tuple(trips), calls, rounds, messages
        self._command = [python, str(Path(folder, "client.py"))]
        self._environment = dict(environment)
        Path(self._command[1]).write_text(CLIENT, encoding="utf-8")
        self.figures: dict[str, list[float]] = {}
        self.error = ""
        self._thread = threading.Thread(target=self._run, daemon=True)

    @property
    def is_done(self) -> bool:
        """True once all have run."""
        return not self._thread.is_alive()

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def _run(self) -> None:
        try:
            with self._start("echo", "/bare", 0) as echo:
                try:
                    if echo.stdout is not None:
                        echo.stdout.readline()
                    self._take_trips()
                finally:
                    echo.terminate()  # a node that leaves waits for its end
            for rate, count in self._messages.items():
                self.figures[rate] = self._ask("joints", JOINTS[rate], count)
        except (subprocess.SubprocessError, ValueError, OSError) as error:
            self.error = str(error)

    def _take_trips(self) -> None:
        for _ in range(self._rounds):
            for trip in self._trips:
                for name in ("/bare", "/bench"):  # in turn, so that other load falls on both
                    self.figures.setdefault(f"{trip} {name}", []).extend(self._ask(trip, name, self._calls))

    def _start(self, trip: str, name: str, count: int) -> subprocess.Popen[str]:
        command = [*self._command, trip, name, str(count)]
        return subprocess.Popen(command, env=self._environment, stdout=subprocess.PIPE, text=True)  # noqa: S603

    def _ask(self, trip: str, name: str, count: int) -> list[float]:
        with self._start(trip, name, count) as client:
            try:
                output, _ = client.communicate(timeout=LIMIT)
            except subprocess.TimeoutExpired:
                client.kill()
                raise
        figures: list[float] = json.loads(output)
        return figures
