"""Measuring client under the Python of ROS 2: `ros2_client.py KIND NAME NUMBER`; prints its result as JSON.

It imports nothing of Cellwright: that Python does not have it.
"""

from __future__ import annotations

import itertools
import json
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, JointState, PointCloud2
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectoryPoint

_DEPTH = 100
_STREAMED: dict[str, Any] = {"clock": Clock, "joint_states": JointState, "image": Image, "points": PointCloud2}
"""Types of streams, by the last part of the name."""


class Client:
    """A node that spins in a thread."""

    def __init__(self, kind: str) -> None:
        rclpy.init()
        self.node = rclpy.create_node(f"{kind}_{time.monotonic_ns()}")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self._spin)

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self.executor.spin()

    def close(self) -> None:
        """Leave the graph."""
        self.executor.create_task(self.executor.shutdown)  # by the thread that spins, which uses what this takes away
        self.thread.join()
        self.node.destroy_node()
        rclpy.try_shutdown()


def echo(client: Client, name: str, _number: float) -> None:
    """Answer pings, calls and goals until stdin ends."""

    def follow(goal: Any) -> Any:
        goal.succeed()
        return FollowJointTrajectory.Result()

    pong = client.node.create_publisher(String, f"{name}/pong", 10)
    client.node.create_subscription(String, f"{name}/ping", pong.publish, 10)
    client.node.create_service(Trigger, f"{name}/ask", lambda _request, response: response)
    server = ActionServer(client.node, FollowJointTrajectory, f"{name}/follow", follow)
    client.thread.start()
    print("ready", flush=True)  # noqa: T201
    sys.stdin.read()
    server.destroy()


def topic(client: Client, name: str, number: float) -> list[float]:
    """Return the times of round trips over a topic [s]."""
    received = threading.Semaphore(0)
    client.node.create_subscription(String, f"{name}/pong", lambda _: received.release(), 10)
    ping = client.node.create_publisher(String, f"{name}/ping", 10)
    client.thread.start()
    while not received.acquire(timeout=0.5):
        ping.publish(String(data="x"))
    time.sleep(0.5)
    while received.acquire(blocking=False):
        pass

    def trip() -> None:
        ping.publish(String(data="x"))
        received.acquire()

    return _times(trip, int(number))


def service(client: Client, name: str, number: float) -> list[float]:
    """Return the times of calls of a service [s]."""
    caller = client.node.create_client(Trigger, f"{name}/ask")
    client.thread.start()
    caller.wait_for_service()

    def call() -> None:
        done = threading.Event()
        caller.call_async(Trigger.Request()).add_done_callback(lambda _: done.set())
        done.wait()

    call()
    return _times(call, int(number))


def action(client: Client, name: str, number: float) -> list[float]:
    """Return the times from goals to their results [s]; the server is done with a goal when it has accepted it."""
    caller = ActionClient(client.node, FollowJointTrajectory, f"{name}/follow")
    goal = FollowJointTrajectory.Goal()
    goal.trajectory.joint_names = [f"joint_{index}" for index in range(7)]
    goal.trajectory.points = [JointTrajectoryPoint(positions=[0.1] * 7)]
    client.thread.start()
    caller.wait_for_server()

    def follow() -> None:
        done = threading.Event()
        statuses: list[int] = []

        def finish(answered: Any) -> None:
            statuses.append(answered.result().status)
            done.set()

        def accept(answered: Any) -> None:
            answered.result().get_result_async().add_done_callback(finish)

        # by the thread that spins: rclpy drops an answer that comes before the sender has noted its goal
        client.executor.create_task(lambda: caller.send_goal_async(goal).add_done_callback(accept))
        done.wait()
        if statuses != [GoalStatus.STATUS_SUCCEEDED]:
            raise ValueError(f"{name}/follow: a goal ended otherwise (got status {statuses[0]})")

    follow()
    times = _times(follow, int(number))
    caller.destroy()
    return times


def _times(trip: Callable[[], None], number: int) -> list[float]:
    found = []
    for index in range(number):
        begin = time.perf_counter()
        trip()
        found.append(time.perf_counter() - begin)
        time.sleep(0.0013 + index % 7 * 0.0001)  # in step with nothing
    return found


def stream(client: Client, name: str, number: float) -> dict[str, float]:
    """Return how many stamped messages came in some seconds, how many are missing between them, and their rate [Hz]."""
    kind = _STREAMED[name.rpartition("/")[2]]
    stamps: list[int] = []

    def take(message: Any) -> None:
        stamp = message.clock if kind is Clock else message.header.stamp
        stamps.append(stamp.sec * 10**9 + stamp.nanosec)

    client.node.create_subscription(kind, name, take, QoSProfile(depth=_DEPTH))
    client.thread.start()
    while not stamps:
        time.sleep(0.01)
    time.sleep(number)
    times = list(stamps)
    apart = [late - early for early, late in itertools.pairwise(times)]
    period = min(apart)
    return {
        "received": len(times),
        "lost": sum(round(each / period) - 1 for each in apart),
        "rate": (len(times) - 1) / (times[-1] - times[0]) * 1e9,
    }


if __name__ == "__main__":
    kind, name, number = sys.argv[1:4]
    client = Client(kind)
    result = {"echo": echo, "topic": topic, "service": service, "action": action, "stream": stream}[kind](
        client, name, float(number)
    )
    client.close()
    print(json.dumps(result), flush=True)  # noqa: T201
