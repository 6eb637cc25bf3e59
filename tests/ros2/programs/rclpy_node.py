"""A node for programs of tests, under the Python of ROS 2: spins in a thread, and waits for what a test expects."""

from __future__ import annotations

import contextlib
import importlib
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

TIMEOUT = 120.0
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
MANY = QoSProfile(depth=5000)


def interface(name: str, kind: str = "msg") -> Any:
    """Return the class of "package/Name"."""
    package, last = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), last)


class Node:
    """A node; use it in a `with`."""

    def __init__(self, name: str = "tester") -> None:
        rclpy.init()
        self.node = rclpy.create_node(name)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def __enter__(self) -> Node:
        return self

    def __exit__(self, *_: object) -> None:
        self.executor.create_task(self.executor.shutdown)  # by the thread that spins, which uses what this takes away
        self._thread.join()
        for client in [each for each in self.node.waitables if isinstance(each, ActionClient)]:
            client.destroy()  # not before: the thread that spins may be about to wait for it
        self.node.destroy_node()
        rclpy.try_shutdown()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self.executor.spin()

    def listen(self, topic: str, type_name: str, qos: Any = 10) -> list[Any]:
        """Return a list that gets the messages of a topic."""
        found: list[Any] = []
        self.node.create_subscription(interface(type_name), topic, found.append, qos)
        return found

    def publisher(self, topic: str, type_name: str, qos: Any = 100) -> Any:
        """Return a publisher that has a subscriber."""
        publisher = self.node.create_publisher(interface(type_name), topic, qos)
        self.wait(lambda: publisher.get_subscription_count() > 0, f"subscriber of {topic}")
        return publisher

    def call(self, service: str, type_name: str, *, timeout: float | None = None, **fields: Any) -> Any:
        """Return the response of a service; with a timeout [s] None if there is none in time."""
        kind = interface(type_name, "srv")
        client = self.node.create_client(kind, service)
        if not client.wait_for_service(TIMEOUT if timeout is None else timeout):
            assert timeout is not None, f"no service {service}"
            return None
        future = client.call_async(kind.Request(**fields))
        if timeout is None:
            return self.result(future)
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        return future.result() if done.wait(timeout) else None

    def result(self, future: Any) -> Any:
        """Return the result of a future."""
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        assert done.wait(TIMEOUT), "no answer"
        return future.result()

    def action_client(self, name: str, type_name: str, **more: Any) -> Any:
        """Return a client of an action, which has a server. The thread that spins makes it.

        Made in another thread it may be waited for before it is complete, which is an error in Kilted.
        """
        kind = interface(type_name, "action")
        client = self.result(self.executor.create_task(lambda: ActionClient(self.node, kind, name, **more)))
        assert client.wait_for_server(TIMEOUT), f"no action {name}"
        return client

    def act(self, function: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        """Call a function of an action's client in the thread that spins, and return the result of its future.

        In another thread rclpy may get the answer before it has noted the request, and ignores it then.
        """
        return self.result(self.result(self.executor.create_task(lambda: function(*arguments, **more))))

    def wait(self, condition: Callable[[], Any], what: str) -> Any:
        """Wait until a condition holds; return its value."""
        end = time.monotonic() + TIMEOUT
        while not (value := condition()):
            assert time.monotonic() < end, f"no {what}"
            time.sleep(0.005)
        return value
