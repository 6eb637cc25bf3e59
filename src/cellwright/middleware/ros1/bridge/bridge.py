"""Bridge between a served cell and ROS 1; run by the path of this file under the python3 that has rospy.

It prints one line on stdout, `ready`, when everything is registered; all other lines go to stderr. Exit status: 0 if
the cell ends or a signal ends the bridge, 1 if it cannot start. 75 means that a new ROS master answers, where
everything has to be registered again: the caller restarts the bridge.
"""

from __future__ import annotations

import argparse
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

import rospy

from cellwright.middleware.ros1.bridge.message_bytes import STEP_MD5, STEP_TYPE, DeliveryCounter
from cellwright.middleware.ros1.bridge.node import (
    Master,
    MasterWatch,
    OwnSubscription,
    begin_node,
    limit_messages,
    listen_on_loopback,
    log_to_rosout,
    run_process,
    stop_by,
    stop_deferred,
)
from cellwright.middleware.ros1.bridge.services import STEP_SERVICE, RosService, StepService, cell_service
from cellwright.middleware.ros1.bridge.state_publisher import HOW_TO_GET_IT, NODE, StatePublisher, find_state_publisher
from cellwright.middleware.ros1.bridge.tcpros import TcprosServer
from cellwright.middleware.ros1.bridge.topics import ClockPublication, CommandTopic, Publication
from cellwright.middleware.wire.command_queue import COMMAND_QUEUE, StepQueue
from cellwright.middleware.wire.connection import LinkClient, address_of
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog, report, report_ready
from cellwright.middleware.wire.frames import ROS2_ONLY

ENDED, MASTER_IS_NEW = 0, 75  # exit statuses: the cell or a signal ended it; restart it

AUTO, NONE = "auto", "none"
CLOCK = "/clock"
STATIC_FRAMES = "/tf_static"

_MASTER_PATIENCE = 5.0
_PUBLISHER_PATIENCE = 10.0
_CHILD_PATIENCE = 1.0
_PAUSE = 0.02


class Bridge:
    """A cell as a ROS node.

    Args:
        address: host and port of the server.
        node: name of the node.
        state_publisher: path of robot_state_publisher, `auto` or `none`.
        frame_source: topic of the joint states from which it computes frames.
        subscribes: own topics that the node also subscribes to.
    """

    def __init__(
        self, address: tuple[str, int], node: str, state_publisher: str, frame_source: str, subscribes: list[str]
    ) -> None:
        self._address = address
        self._node = node
        self._program = state_publisher
        self._frame_source = frame_source
        self._subscribes = subscribes
        self._loop = EventLoop()
        self._frames: StatePublisher | None = None
        self._steps: StepQueue | None = None

    def run(self) -> None:
        """Carry messages until the cell ends, or a signal comes; then end the process."""
        run_process(self._serve, before=self._begin_to_end, after=self._end)

    def _serve(self) -> int:
        self._begin()
        self._loop.wake_by_signals()
        stop_by(lambda: self._loop.stop(ENDED))
        if self._sent is None:
            self._link.keep_up(lambda: any(publication.is_behind for publication in self._sends))
        report_ready()
        return self._loop.run()

    def _begin(self) -> None:
        listen_on_loopback()
        self._link = LinkClient(self._loop, self._address, self._node, self._cell_ended, on_notice=log_to_rosout)
        welcome = self._link.welcome
        in_lockstep = bool(welcome["lockstep"])
        left_out = tuple(f"{each['name']}/" for each in welcome["actions"] if each["type"].startswith(ROS2_ONLY))
        topics = [topic for topic in welcome["topics"] if not topic["name"].startswith(left_out)]
        master = Master(self._node)
        master.wait(_MASTER_PATIENCE)
        self._frames = self._start_state_publisher(in_lockstep=in_lockstep)
        server = TcprosServer(self._loop)
        begin_node(self._node)
        rospy.on_shutdown(lambda: self._loop.stop(ENDED))  # `rosnode kill`, or another node takes the name
        self._sent = DeliveryCounter() if in_lockstep else None
        publications = self._sends = self._publications(topics)
        for publication in publications:
            server.topics[publication.name] = publication.take
            if publication.name != CLOCK:
                with stop_deferred():
                    publication.register()
        with stop_deferred():
            self._subscribe(topics)
        for service in self._services(welcome["services"]):
            server.services[service.resolved_name] = service.take
            with stop_deferred():
                service.register()
        if self._frames is not None:
            self._wait_for_frames(master, self._frames)
        for publication in publications:
            # For programs it is the sign that everything is ready.
            if publication.name == CLOCK:
                with stop_deferred():
                    publication.register()
        MasterWatch(
            self._node,
            rospy.core.get_node_uri(),
            on_new=lambda: self._loop.stop(MASTER_IS_NEW),
            on_replaced=lambda: self._loop.stop(ENDED),
        )

    def _start_state_publisher(self, *, in_lockstep: bool) -> StatePublisher | None:
        """Start it if it is requested and installed; without it the bridge publishes the arm's frames.

        In lockstep it does not run, because time does not wait for it.
        """
        program = find_state_publisher() if self._program == AUTO else self._program
        if program == NONE or in_lockstep:
            return None
        if program is None:
            report(
                f"robot_state_publisher is not installed ({HOW_TO_GET_IT}): {self._node} publishes the frames itself"
            )
            return None
        return StatePublisher(self._loop, program, self._frame_source)

    def _publications(self, topics: list[dict[str, Any]]) -> list[Publication]:
        """Return the publications: all that leaves the cell, except what robot_state_publisher publishes."""
        found = []
        for topic in topics:
            if topic["direction"] != "out":
                continue
            nodes = topic["publishers"]
            origin = ""
            if self._frames is not None and NODE in nodes:
                others = sorted({node for node in nodes if node != NODE})
                if not others:
                    continue
                origin = others[0]
            publication = ClockPublication if topic["name"] == CLOCK and self._sent is None else Publication
            found.append(publication(self._loop, self._link, topic, node=origin, sent=self._sent))
        return found

    def _subscribe(self, topics: list[dict[str, Any]]) -> None:
        """Subscribe to the cell's commands, and to topics of the node itself."""
        limit_messages(ThrottledLog(self._loop, "{count} messages on {subject} dropped: too long").count)
        in_lockstep = self._sent is not None
        self._commands = {
            topic["name"]: CommandTopic(
                self._loop,
                self._link,
                topic,
                limit=None if in_lockstep else COMMAND_QUEUE,
                on_handed_over=(lambda: self._loop.call(self._look_at_steps)) if in_lockstep else None,
                log=log_to_rosout,
            )
            for topic in topics
            if topic["direction"] == "in"
        }
        own = {*self._subscribes, *([] if self._frames is not None else [self._frame_source])}
        for topic in topics:
            if topic["name"] in own and topic["direction"] == "out":
                OwnSubscription(topic["name"], topic["type"]).register()

    def _look_at_steps(self) -> None:
        if self._steps is not None:
            self._steps.look()

    def _services(self, services: list[dict[str, Any]]) -> list[RosService]:
        found = [cell_service(self._loop, self._link, service, log_to_rosout) for service in services]
        if self._sent is not None:
            self._steps = StepQueue(self._loop, self._link, self._commands)
            handler = StepService(self._steps, self._sent).handle
            found.append(RosService(self._loop, STEP_SERVICE, STEP_TYPE, STEP_MD5, handler))
        return found

    def _wait_for_frames(self, master: Master, frames: StatePublisher) -> None:
        """Wait until robot_state_publisher is up, so that programs that find the cell find its frames."""
        end = time.monotonic() + _PUBLISHER_PATIENCE
        while not master.knows(NODE, publishes=STATIC_FRAMES, hears=self._frame_source):
            if time.monotonic() > end or not frames.is_alive:
                report("robot_state_publisher has not started yet: the frames of the arm are missing until it does")
                return
            time.sleep(_PAUSE)

    def _cell_ended(self, reason: str | None) -> None:
        if reason is None:
            report("the cell is gone")
        self._loop.stop(ENDED)

    def _begin_to_end(self) -> None:
        if self._frames is not None:
            self._frames.begin_to_stop()

    def _end(self) -> None:
        if self._frames is not None:
            self._frames.stop(_CHILD_PATIENCE)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="bridge", description="Present a served cell or robot as a ROS 1 node.")
    parser.add_argument("--connect", metavar="HOST:PORT", type=address_of, required=True, help="address of the server")
    parser.add_argument("--name", metavar="/NODE", required=True, help="name of the node")
    parser.add_argument(
        "--robot-state-publisher",
        metavar="PATH",
        default=AUTO,
        help=f"program that publishes the frames of the arm; `{AUTO}` searches for it, `{NONE}` uses none",
    )
    parser.add_argument("--frame-source", metavar="TOPIC", default="", help="joint states that the frames come from")
    parser.add_argument("--subscribe", metavar="TOPICS", default="", help="own topics that the node subscribes to")
    options = parser.parse_args()
    own_topics = options.subscribe.split(",")
    Bridge(options.connect, options.name, options.robot_state_publisher, options.frame_source, own_topics).run()
