"""Connection of an operator to a robot's node, over its socket or over ROS 1, and the robot's limits."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

from cellwright.cli import options, output
from cellwright.cli.declarations import flag, option
from cellwright.clients.client.ros1_transport import Ros1Transport
from cellwright.clients.client.session import NodeClient
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.clients.operators.robot import JOINT_STATES, JointLimits, OperatedRobot
from cellwright.config.robot.robots import bundled, load_robot
from cellwright.config.robot.urdf import read_urdf
from cellwright.middleware.ros1.host import installation
from cellwright.middleware.ros1.host.master import DEFAULT_URI, URI_VARIABLE, Master
from cellwright.middleware.ros1.host.ros1 import node_name
from cellwright.middleware.server import DEFAULT_PORT
from cellwright.middleware.server.server import LOOPBACK
from cellwright.util.errors import CellwrightError, RunEndedError, UsageError

PARAMETER = "robot_description"


def described_limits(environment: Mapping[str, str]) -> JointLimits:
    """The limits of the robot that is described at the master; none if there is none that can be read.

    Args:
        environment: of a program of ROS, which names the master.
    """
    try:
        text = Master(environment.get(URI_VARIABLE) or DEFAULT_URI).parameter(f"/{PARAMETER}")
        if not isinstance(text, str):
            return JointLimits()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{PARAMETER}.urdf"
            path.write_text(text, encoding="utf-8")
            robot = read_urdf(path, warn=_ignore_line)
    except CellwrightError:  # a robot can be driven without
        return JointLimits()
    return JointLimits({joint.name: joint.limits for joint in robot.driven}, PARAMETER)


def _ignore_line(_line: str) -> None:
    pass


WHERE, WHAT, RESULT = "Where the robot is", "What it does", "Output"
"""Headings in the help, under which options are listed."""

NODE = "/operator"

_WAIT = 5.0  # [s] for a node to appear in ROS

Connect = Annotated[
    str | None, option(f"Where the node is served; {LOOPBACK}:{DEFAULT_PORT} when left out.", WHERE, "HOST:PORT")
]

OverRos1 = Annotated[bool, flag("Over ROS 1, at the master that ROS_MASTER_URI names.", WHERE, "--ros1")]

Node = Annotated[str, option("Name of the operator's node.", WHERE, "NAME")]


Robot = Annotated[
    str | None,
    option(
        "The robot's description, for its joint limits: a name, a robot configuration or a URDF. When left out: "
        "of a robot that comes along, or what is at the master as `robot_description`.",
        WHERE,
        "ROBOT",
    ),
]


class NodeConnection:
    """A way to a node, checked; nothing is connected yet.

    Args:
        connect: host and port, as given.
        ros1: whether it is ROS 1.
        node: name of the operator's node.
        robot: the robot's description, as given.

    Raises:
        UsageError: this cannot be meant.
        DescriptionError: the robot's description cannot be used.
    """

    def __init__(self, connect: str | None, *, ros1: bool, node: str = NODE, robot: str | None = None) -> None:
        if ros1 and connect is not None:
            options.refuse("--connect and --ros1: give one of them")
        self.node = node_name(node)
        self._address = options.address("--connect", connect) if connect else (LOOPBACK, DEFAULT_PORT)
        self._limits = None if robot is None else JointLimits.of(load_robot(robot, output.warn).robot)
        self._ros1 = installation.find() if ros1 else None

    def session(self, suffix: str = "") -> NodeClient:
        """A connection of its own.

        Args:
            suffix: behind the name of the node; in ROS no two may be called the same.

        Raises:
            UsageError: no node answers there.
        """
        name = self.node + suffix
        if self._ros1 is None:
            return NodeClient(self._over_socket(name))
        ros = self._ros1
        transport = Ros1Transport(ros.python, node=name, environment=ros.environment, patience=_WAIT, sign=JOINT_STATES)
        return NodeClient(transport)

    @contextmanager
    def robot(self) -> Iterator[OperatedRobot]:
        """The robot; the connection is closed in the end.

        Raises:
            UsageError: the node is gone.
        """
        session = self.session()
        try:
            try:
                robot = OperatedRobot(session)
            except RunEndedError as error:
                raise UsageError(f"the node is gone: {error}") from None
            yield robot
        finally:
            session.close()

    @staticmethod
    def name(robot: OperatedRobot) -> str:
        """What the robot is called, as far as its node says; ROS has no place for that."""
        welcome = getattr(robot.session.transport, "welcome", {})
        return str(welcome.get("trial") or "robot")

    def limits(self, robot: OperatedRobot) -> JointLimits:
        """The limits of the robot's joints, as far as anybody knows them.

        Raises:
            UsageError: it is not the robot that was named.
        """
        if self._limits is not None:
            missing = [name for name in self._limits.joints if name not in robot.joints]
            if missing:
                raise UsageError(
                    f"--robot: {self._limits.source} has a joint {missing[0]}, and the node's robot has not"
                )
            return self._limits
        called = self.name(robot).lower()
        if self._ros1 is not None:
            limits = described_limits(self._ros1.environment)
        elif called in bundled():
            limits = JointLimits.of(load_robot(called, _ignore).robot)
        else:
            return JointLimits()
        return limits if set(limits.joints) <= set(robot.joints) else JointLimits()

    def _over_socket(self, name: str) -> SocketTransport:
        try:
            return SocketTransport(self._address, node=name)
        except UsageError as error:
            host, port = self._address
            raise UsageError(
                f"{error}; start one with: cellwright teleop ROBOT"
                + (f" --port {port}" if (host, port) != (LOOPBACK, DEFAULT_PORT) else "")
            ) from None


def warn_of_unknown(limits: JointLimits) -> None:
    """Say that nothing was checked against limits, where none are known."""
    if not limits.joints:
        output.warn("this robot's joint limits are not known here, so nothing is checked against them; see --robot")


def _ignore(_line: object) -> None:
    pass
