"""ROS 2 node of this process: start, threads that call its callbacks, clean end, and quality of service."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rcl_interfaces.msg import Log
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from cellwright.middleware.ros2.bridge.receiver import Receiver
from cellwright.middleware.wire.event_loop import MissingError, nothing, report

SIGN_OFF_TIMEOUT = 8.0  # time for the node to leave the graph [s]; then the process ends without


_WARN = 30  # level of rcl_interfaces/Log, whose constant is a number in some distributions, and bytes in others
_ENTITIES = ("publisher", "subscription", "service")
_PLACE_IN_SOURCE = re.compile(r",? at /\S+:\d+")  # of rcl's own files
_LOGGED = 100  # lines that a late reader of /rosout gets


def relative(name: str) -> str:
    """Return the relative form of a name, so that the node's namespace and remappings apply to it."""
    return name.lstrip("/")


def split_arguments(words: list[str]) -> tuple[list[str], list[str]]:
    """Return a program's own arguments, and rclpy's, which begin with `--ros-args`."""
    position = words.index("--ros-args") if "--ros-args" in words else len(words)
    return words[:position], words[position:]


def quality(*, is_reliable: bool, is_transient_local: bool, depth: int) -> QoSProfile:
    """Return quality of service in rclpy's terms."""
    return QoSProfile(
        depth=depth,
        history=HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_transient_local else DurabilityPolicy.VOLATILE,
    )


class RosNode:
    """Node of this process, and the threads that call its callbacks: receiver and executor.

    Attributes:
        node: rclpy's node.
        receiver: takes messages, requests and goals, which must be fast; the executor calls all else.
        group: callback group of the executor in which callbacks do not wait for each other.

    Raises:
        MissingError: rclpy cannot start here.
    """

    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        try:
            rclpy.init(args=[sys.argv[0], *arguments], signal_handler_options=SignalHandlerOptions.NO)
            base = name.rpartition("/")
            self.node: Any = rclpy.create_node(base[2], namespace=base[0] or None)
        except Exception as error:  # rclpy has no common class of errors
            words = _PLACE_IN_SOURCE.sub("", f"{type(error).__name__}: {error}")
            raise MissingError(f"ROS 2 cannot start: {words}") from None
        latched = quality(is_reliable=True, is_transient_local=True, depth=_LOGGED)
        self._further: list[Any] = []
        self._rosout = self.node.create_publisher(Log, "/rosout", latched)
        self._own = {id(each) for kind in _ENTITIES for each in getattr(self.node, f"{kind}s")}
        self.receiver = Receiver(self.node)
        self.group = ReentrantCallbackGroup()
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        # Python's own 5 ms would add to the latency of messages.
        sys.setswitchinterval(0.0005)
        self._thread = threading.Thread(target=self._spin, name="executor", daemon=True)

    def full_name(self, topic: str) -> str:
        """Return the name of a topic in the graph, after namespace and remapping rules."""
        name: str = self.node.resolve_topic_name(relative(topic))
        return name

    def full_service_name(self, service: str) -> str:
        """Return the name of a service in the graph, after namespace and remapping rules."""
        name: str = self.node.resolve_service_name(relative(service))
        return name

    def add_node(self, name: str) -> Any:
        """Add a further node to this process, in the namespace of the first; remappings are of the first alone."""
        node = rclpy.create_node(
            name, namespace=self.node.get_namespace(), use_global_arguments=False, enable_rosout=False
        )
        self.executor.add_node(node)
        self._further.append(node)
        return node

    def log(self, line: str) -> None:
        """Publish a warning on /rosout; rclpy's own logger would also print it."""
        stamp = self.node.get_clock().now().to_msg()
        self._rosout.publish(Log(stamp=stamp, level=_WARN, name=self.node.get_logger().name, msg=line))

    def say(self, line: str) -> None:
        """Print a warning, and publish it on /rosout."""
        report(line)
        self.log(line)

    def start(self) -> None:
        """Begin to call callbacks."""
        if not self._thread.is_alive():
            self._thread.start()
        self.receiver.start()

    def renew(self) -> None:
        """Remove all that was offered, so that the node can offer another cell; it stays in the graph."""
        self.receiver.close(SIGN_OFF_TIMEOUT)
        for kind in _ENTITIES:
            for entity in [each for each in getattr(self.node, f"{kind}s") if id(each) not in self._own]:
                getattr(self.node, f"destroy_{kind}")(entity)
        for node in self._further:
            self.executor.remove_node(node)
            node.destroy_node()
        self._further.clear()
        self.receiver = Receiver(self.node)

    def close(self) -> None:
        """Leave the graph; the order is the one in which rclpy ends without complaint."""
        if self._thread.is_alive():
            # in the thread that spins: from another it takes away what that thread is using
            with contextlib.suppress(Exception):
                self.executor.create_task(self.executor.shutdown)
            self._thread.join(SIGN_OFF_TIMEOUT)
        with contextlib.suppress(Exception):
            self.executor.shutdown()
        self.receiver.close(SIGN_OFF_TIMEOUT)
        for node in (*self._further, self.node):
            node.destroy_node()
        rclpy.try_shutdown()

    def _spin(self) -> None:
        while rclpy.ok() and not self._spin_until_defect():
            pass

    def _spin_until_defect(self) -> bool:
        """Call callbacks until one fails, which is no reason to leave the others uncalled; True at the end."""
        try:
            self.executor.spin()
        except ExternalShutdownException:
            return True
        except Exception as defect:
            report(f"internal error, please report it: {type(defect).__name__}: {defect}")
            return False
        return True


def run_process(serve: Callable[[], int], *, after: Callable[[], None] = nothing) -> None:
    """Serve until the end, and end the process in any case.

    Args:
        serve: returns the exit status. It is 0 after a signal, and 1 if something is missing.
        after: leaves the graph.
    """
    status = 1
    try:
        status = serve()
    except MissingError as error:
        report(str(error))
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    watchdog = threading.Timer(SIGN_OFF_TIMEOUT, os._exit, [status])
    watchdog.daemon = True
    watchdog.start()
    after()
    sys.stderr.flush()
    os._exit(status)
