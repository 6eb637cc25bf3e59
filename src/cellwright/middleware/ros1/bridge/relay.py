"""The way of a client that has no rospy to a cell in ROS 1; run by the path of this file under the python3 that has it.

It waits until there is a simulator, and then prints `ready PORT`: there one client may connect, and speak as to a cell
(`cellwright.middleware.wire.frames`). It ends when the client hangs up, when whoever started it closes its stdin, or
when the simulator has ended. There is one while somebody publishes /clock, or another topic that is named as its sign.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
import time
import types
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    # Cellwright's own package is not installed here, and needs what is not either: only these parts of it are loaded.
    sys.path[:] = [folder for folder in sys.path if folder != str(Path(__file__).parent)]
    cellwright = types.ModuleType("cellwright")
    cellwright.__path__ = [str(Path(__file__).resolve().parents[3])]
    sys.modules["cellwright"] = cellwright

import rospy

from cellwright.middleware.ros1.bridge.loop import Loop, ThrottledLog, report, say_ready
from cellwright.middleware.ros1.bridge.master import Master, MasterGoneError, listen_on_loopback
from cellwright.middleware.ros1.bridge.message_bytes import read_step_response, step_request
from cellwright.middleware.ros1.bridge.node import (
    StoppedError,
    begin_node,
    end_process,
    limit_messages,
    stop_by,
    stop_by_exception,
)
from cellwright.middleware.ros1.bridge.relay_server import Relay
from cellwright.middleware.ros1.bridge.ros_client import CLOCK, ServiceClient, ServiceGoneError, discover_interface
from cellwright.middleware.ros1.bridge.services import STEP_SERVICE as STEP
from cellwright.middleware.ros1.bridge.tcpros import raw_type
from cellwright.middleware.wire.frames import LONGEST_FRAME

_NAP = 0.05
_CLOCK_BYTES = 8


class MissingError(Exception):
    """Nobody is there to relay to; the text says who."""


def main(node: str, patience: float, sign: str) -> None:
    """Wait for a simulator, then for a client, and serve it. The process ends here.

    Args:
        node: absolute name of the client's node.
        patience: how long a simulator may take to appear [s].
        sign: the topic that is published where there is one.
    """
    status = 1
    try:
        stop_by_exception()
        listen_on_loopback()
        loop = Loop()
        loop.watch(sys.stdin, lambda: loop.stop(0) if not os.read(0, 4096) else None)
        end = time.monotonic() + patience
        master = Master(node)
        master.wait(patience)
        welcome = _wait_for_simulator(master, node, end, sign)
        tally = ThrottledLog(loop, "{count} messages on {subject} are too long, and not taken")
        limit_messages(tally.count, LONGEST_FRAME // 2)
        begin_node(node)
        rospy.on_shutdown(lambda: loop.stop(0))
        welcome["time"] = _time(master, node, welcome, end)
        listener = socket.create_server(("127.0.0.1", 0))
        loop.watch(listener, lambda: _accept(loop, listener, master, node, welcome, sign))
        loop.wake_by_signals()
        stop_by(lambda: loop.stop(0))
        say_ready(str(listener.getsockname()[1]))
        status = loop.run()
    except (MasterGoneError, MissingError, rospy.ROSInitException) as error:
        report(str(error))
    except StoppedError:
        status = 0
    end_process(status)


def _accept(loop: Loop, listener: socket.socket, master: Master, node: str, welcome: dict[str, Any], sign: str) -> None:
    """Take the one client on."""
    connection, _ = listener.accept()
    loop.forget(listener)
    listener.close()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    Relay(loop, connection, master, node, welcome, sign)


def _wait_for_simulator(master: Master, node: str, end: float, sign: str) -> dict[str, Any]:
    while True:
        welcome = discover_interface(master, node, sign)
        if welcome is not None:
            return welcome
        if time.monotonic() > end:
            raise MissingError(f"there is no simulator at {master.uri}: nobody publishes {sign}")
        time.sleep(_NAP)


def _time(master: Master, node: str, welcome: dict[str, Any], end: float) -> int:
    """Simulation time [ns]; 0 where nobody tells it."""
    if welcome["lockstep"]:
        try:
            _, data = ServiceClient(master, node, STEP).call(step_request(0, {}))
        except ServiceGoneError as error:
            raise MissingError(str(error)) from None
        return read_step_response(data)[1]
    if not any(topic["name"] == CLOCK and topic["direction"] == "out" for topic in welcome["topics"]):
        return 0
    heard: list[bytes] = []
    subscriber = rospy.Subscriber(CLOCK, raw_type("rosgraph_msgs/Clock"), lambda message: heard.append(message.data))
    while not heard:
        if time.monotonic() > end:
            raise MissingError(f"time stands still: nothing comes on {CLOCK}")
        time.sleep(_NAP / 10)
    subscriber.unregister()
    data = heard[-1][:_CLOCK_BYTES]
    return int.from_bytes(data[:4], "little") * 1_000_000_000 + int.from_bytes(data[4:], "little")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="relay", description="A client's way to a cell in ROS 1.")
    parser.add_argument("--node", metavar="/NODE", default="/agent", help="name of the client's node (%(default)s)")
    parser.add_argument(
        "--wait", metavar="S", type=float, default=30.0, help="how long a simulator may take to appear (%(default)s)"
    )
    parser.add_argument(
        "--sign", metavar="/TOPIC", default=CLOCK, help="what is published where there is one (%(default)s)"
    )
    options = parser.parse_args()
    main(options.node, options.wait, options.sign)
