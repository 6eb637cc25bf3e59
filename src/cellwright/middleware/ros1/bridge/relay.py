"""Relay between a client without rospy and a cell in ROS 1; run by the path of this file under the python3 with rospy.

It waits for a simulator, and then prints `ready PORT`: one client may connect there, and use the protocol of a cell
(`cellwright.middleware.wire.frames`). It ends when the client hangs up, when its stdin is closed, or when the simulator
has ended. A simulator is present while /clock has a publisher, or another topic that an option names as its sign.
"""

from __future__ import annotations

import argparse
import sys
import time
import types
from pathlib import Path
from typing import Any, Callable

if __name__ == "__main__":
    # Cellwright and its dependencies are not installed here: load only these parts of it.
    sys.path[:] = [folder for folder in sys.path if folder != str(Path(__file__).parent)]
    cellwright = types.ModuleType("cellwright")
    cellwright.__path__ = [str(Path(__file__).resolve().parents[3])]
    sys.modules["cellwright"] = cellwright

import rospy

from cellwright.middleware.ros1.bridge.message_bytes import read_step_response, step_request
from cellwright.middleware.ros1.bridge.node import (
    Master,
    begin_node,
    limit_messages,
    listen_on_loopback,
    run_process,
    stop_by,
)
from cellwright.middleware.ros1.bridge.ros_client import (
    Ros1Publication,
    Ros1Subscription,
    ServiceClient,
    discover_interface,
)
from cellwright.middleware.ros1.bridge.tcpros import raw_type
from cellwright.middleware.wire.event_loop import EventLoop, MissingError, ThrottledLog
from cellwright.middleware.wire.frames import MAX_FRAME_BYTES
from cellwright.middleware.wire.graph import Graph, PublishedTopic, ServiceGoneError, SubscribedTopic
from cellwright.middleware.wire.relay import CLOCK, STEP, serve_one

_SIMULATOR_NAP = 0.05
_CLOCK_BYTES = 8


class Ros1Graph(Graph):
    """Graph of a master; a simulator is present while the topic `sign` has a publisher."""

    encoding = "ros1"

    def __init__(self, master: Master, node: str, sign: str, services: list[dict[str, Any]]) -> None:
        self._master = master
        self._sign = sign
        self._services = {
            service["name"]: ServiceClient(master, node, service["name"], service["md5"]) for service in services
        }
        self._definitions: dict[str, dict[str, str]] = {}

    def is_over(self) -> bool:
        """True if the sign has no publisher any more."""
        return is_simulator_gone(self._master, self._sign)

    def subscribe(
        self, name: str, type_name: str, deliver: Callable[[tuple[int, ...], bytes], None]
    ) -> SubscribedTopic:
        """Subscribe to a topic."""
        return Ros1Subscription(name, type_name, deliver)

    def declare(self, type_name: str, description: dict[str, Any]) -> None:
        """Note checksum and definition of a type."""
        self._definitions[type_name] = {key: str(description[key]) for key in ("md5", "definition")}

    def advertise(self, name: str, type_name: str) -> PublishedTopic | None:
        """Begin to publish; None if the type is not declared."""
        known = self._definitions.get(type_name)
        return None if known is None else Ros1Publication(name, type_name, known["md5"], known["definition"])

    def call(self, name: str, request: bytes, timeout: float | None) -> tuple[bool, bytes]:
        """Call a service."""
        return self._services[name].call(request, timeout)

    def step(self, duration: int, counts: dict[str, int]) -> tuple[str, int, list[tuple[str, int]]]:
        """Let time pass in lockstep."""
        succeeded, data = self._services[STEP].call(step_request(duration, counts))
        return read_step_response(data) if succeeded else (data.decode(errors="replace"), 0, [])


def is_simulator_gone(master: Master, sign: str = CLOCK) -> bool:
    """True if the topic /clock, or another sign, has no publisher any more."""
    state = master.ask("getSystemState")
    return state is not None and all(name != sign for name, _ in state[0])


def serve(node: str, timeout: float, sign: str) -> int:
    """Wait for a simulator, for `timeout` [s] at most, then for a client, and serve it; return the exit status."""
    listen_on_loopback()
    loop = EventLoop()
    end = time.monotonic() + timeout
    master = Master(node)
    master.wait(timeout)
    welcome = _wait_for_simulator(master, node, end, sign)
    tally = ThrottledLog(loop, "{count} messages on {subject} dropped: too long")
    limit_messages(tally.count, MAX_FRAME_BYTES // 2)
    begin_node(node)
    rospy.on_shutdown(lambda: loop.stop(0))
    welcome["time"] = _time(master, node, welcome, end)
    loop.wake_by_signals()
    stop_by(lambda: loop.stop(0))
    return serve_one(loop, Ros1Graph(master, node, sign, welcome["services"]), welcome)


def _wait_for_simulator(master: Master, node: str, end: float, sign: str) -> dict[str, Any]:
    while True:
        welcome = discover_interface(master, node, sign)
        if welcome is not None:
            return welcome
        if time.monotonic() > end:
            raise MissingError(f"no simulator at {master.uri}: {sign} has no publisher")
        time.sleep(_SIMULATOR_NAP)


def _time(master: Master, node: str, welcome: dict[str, Any], end: float) -> int:
    """Return simulation time [ns]; 0 if it has no publisher."""
    if welcome["lockstep"]:
        try:
            _, data = ServiceClient(master, node, STEP).call(step_request(0, {}))
        except ServiceGoneError as error:
            raise MissingError(str(error)) from None
        return read_step_response(data)[1]
    if not any(topic["name"] == CLOCK and topic["direction"] == "out" for topic in welcome["topics"]):
        return 0
    clocks: list[bytes] = []
    subscriber = rospy.Subscriber(CLOCK, raw_type("rosgraph_msgs/Clock"), lambda message: clocks.append(message.data))
    while not clocks:
        if time.monotonic() > end:
            raise MissingError(f"simulation time stands still: no message on {CLOCK}")
        time.sleep(_SIMULATOR_NAP / 10)
    subscriber.unregister()
    data = clocks[-1][:_CLOCK_BYTES]
    return int.from_bytes(data[:4], "little") * 1_000_000_000 + int.from_bytes(data[4:], "little")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="relay", description="Connect a client to a cell in ROS 1.")
    parser.add_argument("--node", metavar="/NODE", default="/agent", help="name of the client's node (%(default)s)")
    parser.add_argument(
        "--wait", metavar="S", type=float, default=30.0, help="timeout for a simulator to appear (%(default)s)"
    )
    parser.add_argument(
        "--sign", metavar="/TOPIC", default=CLOCK, help="topic that a present simulator publishes (%(default)s)"
    )
    options = parser.parse_args()
    run_process(lambda: serve(options.node, options.wait, options.sign))
