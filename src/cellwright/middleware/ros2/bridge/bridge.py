"""Bridge between a served cell and ROS 2; run by the path of this file under a Python that has rclpy.

It prints one line on stdout, `ready`, when everything is advertised; all other lines go to stderr. Exit status: 0 if
the cell ends or a signal ends the bridge, 1 if it cannot start. Arguments behind `--ros-args` are rclpy's: namespace,
remappings, parameters.
"""

from __future__ import annotations

import argparse
import json
import re
import signal
import sys
import time
import types
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    # Cellwright and its dependencies are not installed here: load only these parts of it.
    sys.path[:] = [folder for folder in sys.path if folder != str(Path(__file__).parent)]
    cellwright = types.ModuleType("cellwright")
    cellwright.__path__ = [str(Path(__file__).resolve().parents[3])]
    sys.modules["cellwright"] = cellwright

from std_msgs.msg import String

from cellwright.middleware.ros2.bridge.actions import CellAction
from cellwright.middleware.ros2.bridge.broadcast import TYPE as JOINT_STATES
from cellwright.middleware.ros2.bridge.controller_nodes import ACTIVITY, NODES, ControllerNodes
from cellwright.middleware.ros2.bridge.graph import NAMESAKE_PATIENCE, GraphWatch
from cellwright.middleware.ros2.bridge.interfaces import is_of_actionlib
from cellwright.middleware.ros2.bridge.node import RosNode, quality, relative, run_process, split_arguments
from cellwright.middleware.ros2.bridge.parameters import CONTROL, PARAMETERS, NodeParameters, description_of
from cellwright.middleware.ros2.bridge.services import CellCalls, CellService, StepService
from cellwright.middleware.ros2.bridge.standard_services import FEATURES, offer_standard_services
from cellwright.middleware.ros2.bridge.topics import ClockPublication, CommandTopic, JointStates, Publication
from cellwright.middleware.wire.command_queue import COMMAND_QUEUE, StepQueue
from cellwright.middleware.wire.connection import LinkClient, address_of
from cellwright.middleware.wire.event_loop import EventLoop, MissingError, report, report_ready
from cellwright.middleware.wire.frames import WORLD_CHANGE, Frame, FrameKind

CLOCK, DESCRIPTION = "/clock", "/robot_description"

ROS1_ONLY = "controller_manager_msgs/"
"""Types of the cell's services that have another form in ROS 2."""

ENDED, ANSWERED, CHANGED = 0, 3, 4

CHANGE_TIMEOUT = 30.0
"""Time [s] in which the server of another world answers."""

_NAME = re.compile(r"/[\w/]+")
_LOOK_PERIOD = 0.05  # time between two looks for subscribers [s]


class Bridge:
    """A cell as a node of ROS 2.

    Args:
        address: host and port of the server.
        node: absolute name of the node.
        names: other names in ROS 2 for names of the cell, both with `{arm}` for a part that is the same.
        arguments: rclpy's.
        is_restarted: another bridge may have been killed, whose node the graph still has for some time.
    """

    def __init__(
        self,
        address: tuple[str, int],
        node: str,
        names: dict[str, list[str]],
        arguments: list[str],
        *,
        is_restarted: bool = False,
    ) -> None:
        self._is_restarted = is_restarted
        self._address = address
        self._names = names
        self._name = node
        self._arguments = arguments
        self._loop = EventLoop()
        self._ros: RosNode | None = None
        self._actions: list[CellAction] = []

    def run(self) -> None:
        """Carry messages until the cell ends, or a signal comes; then end the process."""
        run_process(self._serve, after=self._leave)

    def _serve(self) -> int:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self._loop.stop(ENDED))
        while (status := self._present()) == CHANGED:
            self._clear()
        return status

    def _connect(self) -> LinkClient:
        """Return a connection to the cell; one of another world may take a while."""
        end = time.monotonic() + (CHANGE_TIMEOUT if self._ros is not None else 0.0)
        while True:
            try:
                return LinkClient(self._loop, self._address, self._name, self._cell_ended, "ros2", self._log_notice)
            except MissingError:
                if time.monotonic() > end:
                    raise
            time.sleep(_LOOK_PERIOD)

    def _clear(self) -> None:
        """Remove the offers of a world that has gone; the node stays, and so do programs that know it."""
        assert self._ros is not None
        self._ros.renew()
        self._parameters.withdraw()
        self._loop.close()
        self._loop = EventLoop()

    def _present(self) -> int:
        """Carry messages of one cell until it ends; return CHANGED if another world follows it."""
        self._loop.wake_by_signals()
        self._link = self._connect()
        parameters = self._ask(PARAMETERS, {})
        state = self._ask(CONTROL, {"action": "state"})
        self._has = {FEATURES: self._ask(FEATURES, {}) or {}}
        # A robot would report a refused call.
        has_controllers = self._names and self._link.welcome["actions"]
        self._controllers = [self._ask(each, {}) or {} for each in (NODES, ACTIVITY)] if has_controllers else [{}]
        if parameters is None or state is None:
            return ENDED
        ros = self._ros = self._ros or RosNode(self._name, self._arguments)
        self._offer(ros, self._link.welcome)
        self._parameters = NodeParameters(ros, self._link, parameters, state.get("speed"))
        self._describe(ros, description_of(parameters))
        topics = [*(each.name for each in self._publications), *self._commands]
        names_here = [name for each in topics for name in self._named({"name": each})]
        self._watch = GraphWatch(ros, self._loop, names_here, NAMESAKE_PATIENCE if self._is_restarted else 0.0)
        ros.start()
        if not self._link.welcome["lockstep"]:
            self._link.keep_up(lambda: False)
        self._look()
        report_ready()
        return self._loop.run()

    def _ask(self, service: str, request: dict[str, Any]) -> dict[str, Any] | None:
        """Return the answer of a service of the server; empty if it has none, None if the cell has ended."""
        found: list[Frame] = []

        def answered(frame: Frame) -> None:
            found.append(frame)
            self._loop.stop(ANSWERED)

        self._link.request(FrameKind.CALL, answered, name=service, payload=json.dumps(request).encode())
        if self._loop.run() != ANSWERED:
            return None
        return found[0].json() if found[0].kind is FrameKind.ANSWER else {}

    def _offer(self, ros: RosNode, welcome: dict[str, Any]) -> None:
        """Advertise topics, services and actions; the clock last: for programs it is the sign that all are there."""
        loop, link, in_lockstep, sender = self._loop, self._link, bool(welcome["lockstep"]), self._name
        topics = [topic for topic in welcome["topics"] if not is_of_actionlib(topic["type"])]
        steps_look: list[StepQueue] = []
        self._commands = {
            topic["name"]: CommandTopic(
                ros,
                loop,
                link,
                topic,
                self._named(topic),
                sender,
                limit=None if in_lockstep else COMMAND_QUEUE,
                on_handed_over=(lambda: loop.call(steps_look[0].look)) if in_lockstep else None,
            )
            for topic in topics
            if topic["direction"] == "in"
        }
        out = sorted((topic for topic in topics if topic["direction"] == "out"), key=lambda each: each["name"] == CLOCK)
        sent: dict[str, int] = {}
        calls = CellCalls(link, sender)
        self._services: list[Any] = [
            CellService(ros, loop, calls, service, self._named(service))
            for service in welcome["services"]
            if not service["type"].startswith(ROS1_ONLY)  # `ControllerNodes` has those of ROS 2
        ]
        self._standard = offer_standard_services(ros, calls, self._has)
        if self._controllers[0]:
            self._controller_nodes = ControllerNodes(ros, loop, calls, *self._controllers)
        self._actions = [
            CellAction(ros, loop, link, sender, action, self._named(action)) for action in welcome["actions"]
        ]
        self._publications = [
            self._publication_class(topic)(ros, link, topic, self._named(topic), sent, in_lockstep=in_lockstep)
            for topic in out
        ]
        for publication in self._publications:
            if isinstance(publication, ClockPublication):
                calls.before_answer = publication.flush
        if in_lockstep:
            published = {each.name: each for each in self._publications}
            steps_look.append(StepQueue(loop, link, self._commands))
            self._services.append(StepService(ros, loop, steps_look[0], sender, self._commands, published, sent))

    def _publication_class(self, topic: dict[str, Any]) -> type[Publication]:
        if topic["name"] == CLOCK and not self._link.welcome["lockstep"]:
            return ClockPublication
        return JointStates if topic["type"] == JOINT_STATES and self._controllers[0] else Publication

    def _named(self, described: dict[str, Any]) -> list[str]:
        """Return the names in ROS 2 of what WELCOME describes."""
        name = described["name"]
        if name in self._names:
            return self._names[name]
        for pattern, others in self._names.items():
            found = re.fullmatch(re.escape(pattern).replace(r"\{arm\}", "([^/]+)"), name)
            if found is not None:
                return [other.replace("{arm}", found[1]) for other in others]
        return [name]

    def _describe(self, ros: RosNode, description: str) -> None:
        """Publish the robot's description for programs of ROS 2, which expect a latched topic."""
        if description:
            latched = quality(is_reliable=True, is_transient_local=True, depth=1)
            self._description = ros.node.create_publisher(String, relative(DESCRIPTION), latched)
            self._description.publish(String(data=description))

    def _log_notice(self, line: str) -> None:
        """Publish a line of the cell on /rosout, with the names that its topics have in ROS 2."""
        ros = self._ros
        if ros is None:
            return
        names = {each["name"]: ros.full_name(self._named(each)[0]) for each in self._link.welcome["topics"]}
        ros.log(_NAME.sub(lambda found: names.get(found[0], found[0]), line))

    def _look(self) -> None:
        for publication in self._publications:
            publication.look()
        self._loop.later(_LOOK_PERIOD, self._look)

    def _cell_ended(self, reason: str | None) -> None:
        if reason is None:
            report("the cell is gone")
        for action in self._actions:
            action.end()
        self._loop.stop(CHANGED if reason == WORLD_CHANGE else ENDED)

    def _leave(self) -> None:
        if self._ros is not None:
            self._ros.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="bridge", description="Present a served cell or robot as a node of ROS 2.")
    parser.add_argument("--connect", metavar="HOST:PORT", type=address_of, required=True, help="address of the server")
    parser.add_argument("--name", metavar="/NODE", default="/cellwright", help="name of the node (%(default)s)")
    parser.add_argument(
        "--names", metavar="JSON", type=json.loads, default={}, help="lists of names in ROS 2, by name of the cell"
    )
    parser.add_argument("--restarted", action="store_true", help="another bridge has run for this cell")
    own, for_rclpy = split_arguments(sys.argv[1:])
    options = parser.parse_args(own)
    Bridge(options.connect, options.name, options.names, for_rclpy, is_restarted=options.restarted).run()
