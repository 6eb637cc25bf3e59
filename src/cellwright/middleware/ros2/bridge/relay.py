"""Relay between a client without rclpy and a cell in ROS 2; run by the path of this file under a Python with rclpy.

It waits for a simulator, and then prints `ready PORT`: one client may connect there. A simulator is present while
/clock has a publisher, or another topic that an option names as its sign.

In lockstep a step waits for what the client has published, and the client for what the cell has published. Both count
by the numbers that ROS 2 gives the messages of a publisher.

Arguments behind `--ros-args` are rclpy's: namespace, remappings. The client's names stay those of a cell without them.
"""

from __future__ import annotations

import argparse
import itertools
import json
import signal
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    # Cellwright and its dependencies are not installed here: load only these parts of it.
    sys.path[:] = [folder for folder in sys.path if folder != str(Path(__file__).parent)]
    cellwright = types.ModuleType("cellwright")
    cellwright.__path__ = [str(Path(__file__).resolve().parents[3])]
    sys.modules["cellwright"] = cellwright

from rclpy.serialization import deserialize_message

from cellwright.middleware.ros2.bridge.acquaintance import SERVICE, SERVICE_TYPE, UNPROVEN, Acquaintance
from cellwright.middleware.ros2.bridge.interfaces import fill, interface_class, is_values
from cellwright.middleware.ros2.bridge.node import RosNode, relative, run_process, split_arguments
from cellwright.middleware.ros2.bridge.relay_topics import SETTLING, Ros2Publication, Ros2Subscription
from cellwright.middleware.ros2.bridge.services import NANOSECONDS, STEP_TYPE
from cellwright.middleware.ros2.bridge.topics import as_bytes
from cellwright.middleware.wire.event_loop import EventLoop, MissingError
from cellwright.middleware.wire.frames import PROTOCOL
from cellwright.middleware.wire.graph import Graph, PublishedTopic, ServiceGoneError, SubscribedTopic
from cellwright.middleware.wire.relay import CLOCK, STEP, serve_one

_NAP = 0.02
_QUIET = 0.2  # time without news after which all of a node is known [s]
_QUIET_ALONE = 2.0  # the same while nothing that takes messages is known [s]: on a busy machine that may come late
_OF_EVERY_NODE = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "get_type_description",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
_HIDDEN = "/_action/"


class Ros2Graph(Graph):
    """Graph of a domain, as far as the node's namespace and remapping rules lead to it.

    Args:
        ros: this process's node.
        sign: the topic that a present simulator publishes.
        remapped: names that remapping rules replace.
    """

    encoding = "ros2"

    def __init__(self, ros: RosNode, sign: str, remapped: Sequence[str]) -> None:
        self._ros = ros
        self._sign = sign
        self._remapped = remapped
        self._services: dict[str, Any] = {}
        self._types: dict[str, str] = {}
        self._base: dict[str, int] = {}
        """Messages that the cell had received on each topic before this client's first."""
        self._prepared: dict[str, Ros2Publication] = {}

    def discover(self, end: float) -> dict[str, Any]:
        """Wait for the simulator until `end` of the monotonic clock; return WELCOME, without the time.

        Raises:
            MissingError: there is none.
        """
        node = self._ros.node
        while self.is_over():
            if time.monotonic() > end:
                sign = self._ros.full_name(self._sign)
                raise MissingError(f"no simulator in this domain of ROS 2: {sign} has no publisher")
            time.sleep(_NAP)
        self._await_rest(end)
        self._types = {
            name: kind.replace("/srv/", "/")
            for name, kind in self._named(node.get_service_names_and_types(), self._ros.full_service_name)
            if name.rpartition("/")[2] not in _OF_EVERY_NODE
        }
        topics = [
            {
                "name": name,
                "type": kind.replace("/msg/", "/"),
                "direction": "out" if node.count_publishers(self._ros.full_name(name)) else "in",
                "publishers": [info.node_name for info in node.get_publishers_info_by_topic(relative(name))],
                "subscribers": [info.node_name for info in node.get_subscriptions_info_by_topic(relative(name))],
            }
            for name, kind in self._named(node.get_topic_names_and_types(), self._ros.full_name)
        ]
        if STEP not in self._types:
            self._prepare(topics)
        return {
            "protocol": PROTOCOL,
            "cellwright": "",
            "trial": "",
            "timestep": [0, 1],
            "lockstep": STEP in self._types,
            "competition": None,
            "topics": topics,
            "services": [{"name": name, "type": kind, "node": ""} for name, kind in self._types.items()],
        }

    def _named(self, found: list[tuple[str, list[str]]], full_name: Callable[[str], str]) -> Iterator[tuple[str, str]]:
        """Yield the client's name and the type of each topic or service that it can reach.

        A name outside the namespace, to which no rule leads, has no name of the client.
        """
        space = self._ros.node.get_namespace().rstrip("/")
        names = [name.removeprefix(space) for name, _ in found if name.startswith(f"{space}/")]
        by_full_name = {full_name(name): name for name in [*names, *self._remapped]}
        for name, kinds in found:
            if _HIDDEN not in name and name in by_full_name:
                yield by_full_name[name], kinds[0]

    def _await_rest(self, end: float) -> None:
        """Wait until nothing new appears: a node's topics and services become known one after another."""
        node, known, since = self._ros.node, (0, 0, 0), time.monotonic()
        quiet = _QUIET_ALONE
        while time.monotonic() < min(since + quiet, end):
            found = node.get_topic_names_and_types()
            ends = sum(node.count_publishers(name) + node.count_subscribers(name) for name, _ in found)
            now = (len(found), len(node.get_service_names_and_types()), ends)
            if now != known:
                known, since = now, time.monotonic()
                reached = [self._ros.full_name(name) for name, _ in self._named(found, self._ros.full_name)]
                quiet = _QUIET if any(map(node.count_subscribers, reached)) else _QUIET_ALONE
            time.sleep(_NAP)

    def _prepare(self, topics: list[dict[str, Any]]) -> None:
        """Advertise what the simulator's node subscribes to with best effort, so that the first message arrives."""
        theirs = {info.node_name for info in self._ros.node.get_publishers_info_by_topic(relative(self._sign))}
        for topic in topics:
            name, type_name = topic["name"], topic["type"]
            if theirs & set(topic["subscribers"]) and self._best_effort_subscribers([name]):
                self._prepared[name] = Ros2Publication(self._ros, name, type_name, 0)
        self._acquaint(*self._prepared.values())

    def _acquaint(self, *publications: Ros2Publication) -> None:
        """Let publications wait until their best-effort subscribers know them; all of them are made already."""
        nodes = self._best_effort_subscribers([each.name for each in publications])
        if not nodes:
            return
        node, kind = self._ros.node, interface_class(SERVICE_TYPE, "srv")
        offered = {name for name, _ in node.get_service_names_and_types()}
        clients = [
            node.create_client(kind, name, callback_group=self._ros.group)
            for each in sorted(nodes)
            if (name := f"{each}/{SERVICE}") in offered
        ]
        delay = UNPROVEN if len(clients) < len(nodes) else 0.0
        acquaintance = Acquaintance(clients, kind.Request(), node.destroy_client)
        for publication in publications:
            publication.await_subscribers(acquaintance, delay)

    def _best_effort_subscribers(self, names: Sequence[str]) -> set[str]:
        """Return the full names of the nodes that subscribe to topics with best effort."""
        infos = [info for name in names for info in self._ros.node.get_subscriptions_info_by_topic(relative(name))]
        return {
            f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            for info in infos
            if info.qos_profile.reliability.name == "BEST_EFFORT"
        }

    def now(self, end: float, *, in_lockstep: bool) -> int:
        """Return simulation time [ns]; 0 if nothing publishes it.

        Raises:
            MissingError: it stands still until `end` of the monotonic clock.
        """
        if in_lockstep:
            _, now, sent = self.step(0, {})
            self._base = dict(sent)
            return now
        node = self._ros.node
        if not node.count_publishers(self._ros.full_name(CLOCK)):
            return 0
        clocks: list[Any] = []
        subscription = node.create_subscription(
            interface_class("rosgraph_msgs/Clock", "msg"), relative(CLOCK), clocks.append, 10
        )
        while not clocks:
            if time.monotonic() > end:
                raise MissingError(f"simulation time stands still: no message on {CLOCK}")
            time.sleep(_NAP / 10)
        node.destroy_subscription(subscription)
        return int(clocks[-1].clock.sec * NANOSECONDS + clocks[-1].clock.nanosec)

    def is_over(self) -> bool:
        """True if the sign has no publisher, or none any more."""
        return not self._ros.node.count_publishers(self._ros.full_name(self._sign))

    def subscribe(
        self, name: str, type_name: str, deliver: Callable[[tuple[int, ...], bytes], None]
    ) -> SubscribedTopic:
        """Subscribe to a topic."""
        return Ros2Subscription(self._ros, name, type_name, deliver)

    def advertise(self, name: str, type_name: str) -> PublishedTopic:
        """Begin to publish."""
        prepared = self._prepared.get(name)
        if prepared is not None and prepared.type == type_name:
            return prepared
        publication = Ros2Publication(self._ros, name, type_name, self._base.get(name, 0))
        self._acquaint(publication)
        return publication

    def settle(self, topic: SubscribedTopic) -> None:
        """Wait until the cell knows of a subscription, and its latched message has come."""
        count = self._ros.node.count_subscribers(self._ros.full_name(topic.name))
        failure, _, sent = self.step(0, {topic.name: count})
        before = dict(sent).get(topic.name, 0)
        if not failure and isinstance(topic, Ros2Subscription):
            topic.settle(before)

    def call(self, name: str, request: bytes, timeout: float | None) -> tuple[bool, bytes]:
        """Call a service; ROS 2 has no way to tell that it failed."""
        type_name = self._types[name]
        kind = interface_class(type_name, "srv")
        message = (
            fill(kind.Request(), json.loads(request))
            if is_values(type_name)
            else deserialize_message(request, kind.Request)
        )
        return True, as_bytes(self._answer(name, kind, message, timeout), type_name)

    def step(self, duration: int, counts: dict[str, int]) -> tuple[str, int, list[tuple[str, int]]]:
        """Let time pass in lockstep."""
        kind = interface_class(STEP_TYPE, "srv")
        request = kind.Request(topics=list(counts), published=list(counts.values()))
        request.duration.sec, request.duration.nanosec = divmod(duration, NANOSECONDS)
        answer = self._answer(STEP, kind, request, None)
        now = answer.time.sec * NANOSECONDS + answer.time.nanosec
        failure = "" if answer.success else answer.message or "step failed"
        return failure, now, list(zip(answer.topics, answer.sent, strict=True))

    def _answer(self, name: str, kind: Any, request: Any, timeout: float | None) -> Any:
        client = self._services.get(name)
        if client is None:
            client = self._services[name] = self._ros.node.create_client(
                kind, relative(name), callback_group=self._ros.group
            )
        if not client.wait_for_service(SETTLING):
            raise ServiceGoneError(f"there is no service {name}")
        done = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: done.set())
        end = None if timeout is None else time.monotonic() + timeout
        while not done.wait(1.0):
            if self.is_over():
                raise ServiceGoneError(f"{name} has ended before its answer")
            if end is not None and time.monotonic() > end:
                raise ServiceGoneError(
                    f"{name} has not answered within {timeout:g} s: over ROS 2 in lockstep, time stands during a "
                    "call, so a service that takes time cannot answer"
                )
        return future.result()


def remapped_names(arguments: Sequence[str]) -> list[str]:
    """Return the names that remapping rules among rclpy's arguments replace, as a client writes them."""
    rules = [rule for option, rule in itertools.pairwise(arguments) if option in ("-r", "--remap")]
    # a rule may begin with the name of a node or the kind of the name: `arm:tf:=tf2`, `rostopic://tf:=tf2`
    names = [relative(rule.partition(":=")[0].rpartition(":")[2]) for rule in rules]
    return [f"/{name}" for name in names if not name.startswith("__")]


class RelayProcess:
    """This process, as a node with rclpy's arguments; it waits `timeout` [s] for a simulator."""

    def __init__(self, node: str, timeout: float, sign: str, arguments: Sequence[str]) -> None:
        self._node = node
        self._arguments = arguments
        self._end = time.monotonic() + timeout
        self._sign = sign
        self._ros: RosNode | None = None

    def run(self) -> None:
        """Serve a client; then end the process."""
        run_process(self._serve, after=self._leave)

    def _serve(self) -> int:
        loop = EventLoop()
        ros = self._ros = RosNode(self._node, self._arguments)
        ros.start()
        graph = Ros2Graph(ros, self._sign, remapped_names(self._arguments))
        welcome = graph.discover(self._end)
        welcome["time"] = graph.now(self._end, in_lockstep=welcome["lockstep"])
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: loop.stop(0))
        loop.wake_by_signals()
        return serve_one(loop, graph, welcome)

    def _leave(self) -> None:
        if self._ros is not None:
            self._ros.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="relay", description="Connect a client to a cell in ROS 2.")
    parser.add_argument("--node", metavar="/NODE", default="/agent", help="name of the client's node (%(default)s)")
    parser.add_argument(
        "--wait", metavar="S", type=float, default=30.0, help="timeout for a simulator to appear (%(default)s)"
    )
    parser.add_argument(
        "--sign", metavar="/TOPIC", default=CLOCK, help="topic that a present simulator publishes (%(default)s)"
    )
    own, for_rclpy = split_arguments(sys.argv[1:])
    options = parser.parse_args(own)
    RelayProcess(options.node, options.wait, options.sign, for_rclpy).run()
