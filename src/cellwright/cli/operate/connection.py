"""Connection of an operator to a robot's node: its options, its transport, and the limits of the robot's joints."""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cellwright.cli import options, output
from cellwright.cli.main import ros_arguments
from cellwright.cli.parameters import flag, option
from cellwright.clients.client.ros1_transport import Ros1Transport
from cellwright.clients.client.ros2_transport import Ros2Transport
from cellwright.clients.client.session import NodeClient
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.clients.operators.robot import JOINT_STATES, JointLimits, OperatedRobot
from cellwright.config.robot.robots import bundled, load_robot
from cellwright.config.robot.urdf import read_urdf
from cellwright.middleware.ros1.host import installation
from cellwright.middleware.ros1.host.master import DEFAULT_URI, URI_VARIABLE, MasterClient
from cellwright.middleware.ros1.identity import node_name
from cellwright.middleware.server import DEFAULT_PORT
from cellwright.middleware.server.server import LOOPBACK
from cellwright.util.errors import CellwrightError, RunEndedError, UsageError

if TYPE_CHECKING:
    from cellwright.middleware.ros2.host.installation import Installation

MOTION = "Motion"
"""Heading for options in the help."""

NODE = "/operator"

_CONNECTION = "Connection"
_PARAMETER = "robot_description"
_NODE_TIMEOUT = 5.0  # [s] for a node to appear in ROS
_DESCRIPTION_TIMEOUT = 2.0  # [s] for a robot's description to arrive, which waits at its publisher

Node = Annotated[str, option("NAME", "Name of the operator node.", _CONNECTION)]
Robot = Annotated[
    str | None,
    option(
        "ROBOT",
        "Robot description for the joint limits: a name, a robot configuration or a URDF. Default: that of the "
        "bundled robot, or `robot_description` in ROS.",
        _CONNECTION,
    ),
]


@dataclass(frozen=True)
class AddressArguments:
    """Options of the address of a robot's node."""

    connect: Annotated[
        str | None,
        option("HOST:PORT", f"Address of the node's server. Default: {LOOPBACK}:{DEFAULT_PORT}.", _CONNECTION),
    ] = None
    ros1: Annotated[bool, flag("--ros1", "Connect over ROS 1, at the master in ROS_MASTER_URI.", _CONNECTION)] = False
    ros2: Annotated[
        bool,
        flag(
            "--ros2",
            "Connect over ROS 2, in the domain ROS_DOMAIN_ID. Arguments behind `--ros-args` are the operator node's "
            "own.",
            _CONNECTION,
        ),
    ] = False

    def refuse(self) -> None:
        """Refuse two addresses."""
        given = {"--connect": self.connect is not None, "--ros1": self.ros1, "--ros2": self.ros2}
        if sum(given.values()) > 1:
            options.refuse(f"{' and '.join(name for name in given if given[name])}: give one of them")


class NodeConnection:
    """Address of a node, checked; it opens no connection yet."""

    def __init__(self, address: AddressArguments, node: str = NODE, robot: str | None = None) -> None:
        address.refuse()
        self.node = node_name(node)
        self._address = options.address("--connect", address.connect) if address.connect else (LOOPBACK, DEFAULT_PORT)
        self._limits = None if robot is None else JointLimits.of(load_robot(robot, output.warn).robot)
        self._ros1 = installation.find() if address.ros1 else None
        self._ros2 = _find_ros2() if address.ros2 else None

    def session(self, suffix: str = "") -> NodeClient:
        """Return a new connection, with a suffix to its name: names are unique in ROS."""
        name = self.node + suffix
        in_ros: dict[str, Any] = {"node": name, "timeout": _NODE_TIMEOUT, "sign": JOINT_STATES}
        if self._ros1 is not None:
            return NodeClient(Ros1Transport(self._ros1.python, environment=self._ros1.environment, **in_ros))
        if self._ros2 is not None:
            found = self._ros2
            return NodeClient(
                Ros2Transport(found.python, environment=found.environment, arguments=ros_arguments, **in_ros)
            )
        host, port = self._address
        try:
            return NodeClient(SocketTransport((host, port), node=name))
        except UsageError as error:
            more = f" --port {port}" if (host, port) != (LOOPBACK, DEFAULT_PORT) else ""
            raise UsageError(f"{error}; start one with: cellwright teleop ROBOT{more}") from None

    @contextmanager
    def robot(self) -> Iterator[OperatedRobot]:
        """Return the robot; its connection is closed at the end."""
        session = self.session()
        try:
            try:
                robot = OperatedRobot(session)
            except RunEndedError as error:
                raise UsageError(f"the node has ended: {error}") from None
            yield robot
        finally:
            session.close()

    @staticmethod
    def name(robot: OperatedRobot) -> str:
        """Return the robot's name as its node reports it; ROS has no place for that."""
        welcome = getattr(robot.session.transport, "welcome", {})
        return str(welcome.get("trial") or "robot")

    def limits(self, robot: OperatedRobot) -> JointLimits:
        """Return the known limits of the robot's joints."""
        if self._limits is not None:
            missing = [name for name in self._limits.joints if name not in robot.joints]
            if missing:
                raise UsageError(
                    f"--robot: {self._limits.source} has a joint {missing[0]} that the node's robot lacks; "
                    "give the description of that robot"
                )
            return self._limits
        called = self.name(robot).lower()
        if self._ros1 is not None:
            limits = described_limits(self._ros1.environment)
        elif self._ros2 is not None:
            limits = published_limits(robot.session)
        elif called in bundled():
            limits = JointLimits.of(load_robot(called, lambda _line: None).robot)
        else:
            return JointLimits()
        return limits if set(limits.joints) <= set(robot.joints) else JointLimits()


def warn_of_unknown(limits: JointLimits) -> None:
    """Warn that nothing was checked against limits, if none are known."""
    if not limits.joints:
        output.warn("joint limits unknown: targets are not checked against them; give the description with --robot")


def described_limits(environment: Mapping[str, str]) -> JointLimits:
    """Return the limits of the robot at the ROS master of an environment; none if there is no readable one."""
    try:
        return read_limits(MasterClient(environment.get(URI_VARIABLE) or DEFAULT_URI).parameter(f"/{_PARAMETER}"))
    except CellwrightError:  # driving a robot works without limits
        return JointLimits()


def published_limits(session: NodeClient) -> JointLimits:
    """Return the limits of the robot on the topic `robot_description` of ROS 2; none if there is no readable one."""
    if f"/{_PARAMETER}" not in session.transport.topics():
        return JointLimits()
    message = session.latest(f"/{_PARAMETER}").wait(_DESCRIPTION_TIMEOUT)
    return read_limits(getattr(message, "data", None))


def read_limits(text: object) -> JointLimits:
    """Return the limits in a URDF's text; none if it is no readable one."""
    if not isinstance(text, str):
        return JointLimits()
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{_PARAMETER}.urdf"
            path.write_text(text, encoding="utf-8")
            robot = read_urdf(path, warn=lambda _line: None)
    except CellwrightError:  # driving a robot works without limits
        return JointLimits()
    return JointLimits.of(robot, _PARAMETER)


def _find_ros2() -> "Installation":
    from cellwright.middleware.ros2.host.installation import find  # slow to load

    return find()
