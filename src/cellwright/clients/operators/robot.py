"""Operated robot: the topics and services of a robot's node, its joint limits, and the orders to it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeAlias

from cellwright.clients.client.session import NodeClient
from cellwright.config.robot.model import Limits, RobotModel
from cellwright.middleware.messages import TYPES, conversions
from cellwright.middleware.messages.standard import Bool, PoseArray
from cellwright.middleware.messages.std_srvs import SetBoolRequest, TriggerRequest
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError, UsageError
from cellwright.util.pose import Pose

JOINT_STATES = "/io_teleop/joint_states"
JOINT_COMMAND = "/io_teleop/joint_cmd"
GRIPPER_COMMAND = "/io_teleop/target_gripper_status"
TIP_COMMAND = "/io_teleop/target_ee_poses"
BASE_COMMAND = "/io_teleop/target_base_move"
EMERGENCY_STOP = "/io_teleop/emergency_stop"

_LIMIT_SLACK = 2e-3  # [rad; m] that a joint measured at its limit may lie outside; the node clamps it

_UNKNOWN_LIMITS = Limits()
FIRST_STATES_TIMEOUT = 5.0
"""Longest wait [s] for the first joint states."""
SETTLE = 0.5
"""Time [s] for first messages on the other topics; they are published 100 times a second."""
_STOPPED, _DISABLED = "the emergency stop is active", "it is not enabled"
HOME_SERVICE = "/io_teleop_reset_robot"
ENABLE_SERVICE = "/io_teleop/set_enabled"
CLEAR_STOP_SERVICE = "/io_teleop/clear_emergency_stop"


@dataclass(frozen=True)
class JointLimits:
    """Limits by joint; those of other joints are unknown."""

    joints: Mapping[str, Limits] = field(default_factory=dict)
    source: str = ""
    """Origin of the limits, for messages; empty where none is known."""
    leaders: Mapping[str, str] = field(default_factory=dict)
    """Joint that each known mimic joint follows."""

    @classmethod
    def of(cls, robot: RobotModel, source: str = "") -> JointLimits:
        """Return the limits of a robot's description; `source` is the robot's name by default."""
        leaders = {joint.name: joint.mimic.joint for joint in robot.driven if joint.mimic is not None}
        return cls({joint.name: joint.limits for joint in robot.driven}, source or robot.name, leaders)

    def of_joint(self, name: str) -> Limits:
        """Return the limits of a joint, infinite where unknown."""
        return self.joints.get(name, _UNKNOWN_LIMITS)

    def clamped(self, name: str, position: float) -> float:
        """Return a position [rad; m] clamped to the limits of a joint."""
        limits = self.of_joint(name)
        return min(max(position, limits.lower), limits.upper)

    def check(self, name: str, low: float, high: float, motion: str, remedy: str = "") -> None:
        """Refuse a motion of a joint from `low` to `high` [rad; m] that leaves its limits.

        The error ends with `remedy`.

        Raises:
            UsageError: it leaves them.
        """
        limits = self.of_joint(name)
        if low < limits.lower - _LIMIT_SLACK or high > limits.upper + _LIMIT_SLACK:
            raise UsageError(
                f"{name}: {motion} from {low:.4g} to {high:.4g} leaves its limits ({self.source}): "
                f"{limits.lower:.4g} to {limits.upper:.4g}{remedy and f'; {remedy}'}"
            )

    @property
    def is_known(self) -> bool:
        """True if the limits of any joint are known."""
        return any(math.isfinite(limit.upper - limit.lower) for limit in self.joints.values())


@dataclass(frozen=True, slots=True)
class MoveJoints:
    """Order to move joints to positions [rad; m]; `topic` takes commands of joints."""

    targets: Mapping[str, float]
    topic: str = JOINT_COMMAND


@dataclass(frozen=True, slots=True)
class MoveTips:
    """Order to move the tip of each arm to a pose, base_T_tip: right, left."""

    tips: tuple[Pose, ...]


@dataclass(frozen=True, slots=True)
class MoveGrippers:
    """Order to move each gripper to a closed share, 0 to 1: right, left."""

    closed: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class MoveBase:
    """Order to move the base: two or three numbers, as `BaseMode` in `cellwright.config.robot.config` says."""

    numbers: tuple[float, ...]


class Ask(Enum):
    """Order to call a service."""

    HOME = "home"
    ENABLE = "enable"
    DISABLE = "disable"
    CLEAR_STOP = "clear the emergency stop"


class Now(Enum):
    """Order of highest priority."""

    STOP = "emergency stop"
    QUIT = "quit"


Order: TypeAlias = MoveJoints | MoveTips | MoveGrippers | Ask | Now


def command_message(order: MoveJoints | MoveTips | MoveGrippers | MoveBase | Now, time: int) -> tuple[str, Any]:
    """Return the topic of an order and its message, stamped with `time` [ns] of the node's clock."""
    match order:
        case MoveJoints():
            return order.topic, conversions.joint_state(list(order.targets), list(order.targets.values()), time=time)
        case MoveTips():
            return TIP_COMMAND, PoseArray(
                conversions.header(time=time), [conversions.pose_message(tip) for tip in order.tips]
            )
        case MoveGrippers():
            names = [f"gripper_{number}" for number in range(len(order.closed))]
            return GRIPPER_COMMAND, conversions.joint_state(names, list(order.closed), time=time)
        case MoveBase():
            array, layout = (TYPES.message(f"std_msgs/{name}") for name in ("Float64MultiArray", "MultiArrayLayout"))
            return BASE_COMMAND, array(layout=layout(dim=[], data_offset=0), data=conversions.floats(order.numbers))  # type: ignore[call-arg]
        case Now():
            return EMERGENCY_STOP, Bool(True)


class OperatedRobot:
    """A robot's node.

    Only joint states are required; another vendor's node may publish no grippers, tips or status.

    Raises:
        UsageError: no joint states arrive.
    """

    def __init__(self, session: NodeClient) -> None:
        self.session = session
        self._clock = (0, 0)  # count of joint states, and lead of the node's clock over the session's [ns]
        self._stamp = 0
        self.sent = 0
        """Number of messages sent to it."""
        self._states = session.latest(JOINT_STATES)
        self._applied = session.latest("/io_teleop/applied_joint_cmd")
        self._grippers = session.latest("/io_teleop/gripper_states")
        self._tips = session.latest("/io_teleop/state_ee_poses")
        self._status = session.latest("/io_teleop/status")
        if self._states.wait(FIRST_STATES_TIMEOUT) is None:
            raise UsageError(f"no messages on {JOINT_STATES}: check that a robot controller node runs there")
        others = (self._applied, self._grippers, self._tips, self._status)
        session.wait_until(lambda: all(topic.message is not None for topic in others), SETTLE)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all joints that are not fixed, as the node orders them."""
        return tuple(self._states.message.name)

    @property
    def positions(self) -> dict[str, float]:
        """Newest joint positions [rad; m]."""
        return by_name(self._states.message)

    def position(self, joint: str) -> float:
        """Return the newest position of a joint [rad; m].

        Raises:
            UsageError: the node does not publish it.
        """
        try:
            return self.positions[joint]
        except KeyError:
            raise UsageError(f"the node publishes no position of {joint}") from None

    @property
    def applied(self) -> dict[str, float]:
        """Newest targets that the node applies [rad; m]; empty where it publishes none."""
        return by_name(self._applied.message)

    @property
    def grippers(self) -> tuple[float, ...]:
        """Newest closed share of each gripper, 0 to 1; empty where the node publishes none."""
        message = self._grippers.message
        return () if message is None else tuple(map(float, message.position))

    @property
    def tips(self) -> tuple[Pose, ...]:
        """Newest pose of each arm's tip, base_T_tip; empty where the node publishes none."""
        message = self._tips.message
        return () if message is None else tuple(map(conversions.pose_from_message, message.poses))

    @property
    def status(self) -> Any:
        """Newest state of commands (cellwright_msgs/TeleopStatus); None where the node publishes none."""
        return self._status.message

    def why_not(self) -> str:
        """Return the reason why the node takes no commands; empty when it takes them, or publishes no status."""
        status = self.status
        if status is None:
            return ""
        if status.emergency_stop:
            return _STOPPED
        if status.resetting:
            return "it is moving home"
        return "" if status.enabled else _DISABLED

    def check_ready(self) -> None:
        """Refuse a node that takes no commands.

        Raises:
            UsageError: the reason, and its remedy.
        """
        reason = self.why_not()
        if reason:
            word = {_STOPPED: "clear-stop", _DISABLED: "enable"}.get(reason, "")
            hint = f"; to change that: cellwright operate call {word}" if word else ""
            raise UsageError(f"the robot takes no commands: {reason}{hint}")

    def check_names(self, names: Iterable[str]) -> None:
        """Refuse joints that the robot has not.

        Raises:
            UnknownNameError: with the names of its joints.
        """
        for name in names:
            if name not in self.joints:
                raise UnknownNameError("joint", name, self.joints)

    def send(self, order: MoveJoints | MoveTips | MoveGrippers | MoveBase | Now) -> None:
        """Send a command; after an emergency stop the node refuses others until that is cleared."""
        self.session.publish(*command_message(order, self._now()))
        self.sent += 1

    def _now(self) -> int:
        """Return the node's time [ns], from the stamps of its joint states: it may check a command's age."""
        now = self.session.transport.now()
        if self._states.count != self._clock[0]:
            stamp = conversions.nanoseconds(self._states.message.header.stamp)
            self._clock = (self._states.count, (stamp or now) - now)
        self._stamp = max(self._stamp, now + self._clock[1])
        return self._stamp


def by_name(message: Any) -> dict[str, float]:
    """Return the finite positions in a message of joints; nothing of None."""
    if message is None:
        return {}
    # Other vendors' lists may differ in length.
    values = zip(message.name, map(float, message.position), strict=False)
    return {name: value for name, value in values if math.isfinite(value)}


class ServiceCaller:
    """Calls one service at a time, in a thread, over a connection that `open_session` makes there on demand."""

    def __init__(self, open_session: Callable[[], NodeClient]) -> None:
        self._open = open_session
        self._session: NodeClient | None = None
        self._thread: threading.Thread | None = None
        self._answer = ""
        self.pending = ""
        """Name of the pending call; empty if there is none."""

    def begin(self, ask: Ask) -> bool:
        """Call a service; False if another call is pending."""
        if self._thread is not None:
            return False
        self.pending = ask.value
        self._thread = threading.Thread(target=self._call, args=(ask,), daemon=True)
        self._thread.start()
        return True

    def answer(self) -> str:
        """Return the newest answer of a service once, in a sentence; empty while there is none."""
        if self._thread is None or self._thread.is_alive():
            return ""
        self._thread, self.pending = None, ""
        return self._answer

    def close(self) -> None:
        """Close the connection; a pending answer is abandoned."""
        if self._session is not None:
            self._session.close()

    def _call(self, ask: Ask) -> None:
        try:
            self._session = self._session or self._open()
            # Each call has a thread of its own, one after the other.
            self._session.adopt()
            response = self._session.call(*service_request(ask))
            outcome = "done" if response.success else "refused"
            answer = f"{outcome}; {response.message}" if response.message else outcome
        except (CellwrightError, RunEndedError) as error:
            answer = str(error)
        except Exception as error:  # the operator waits for an answer, and a thread that dies gives none
            answer = f"failed: {type(error).__name__}: {error}"
        self._answer = f"{ask.value}: {answer}"


def service_request(ask: Ask) -> tuple[str, Any]:
    """Return the service of an order, and its request."""
    if ask in (Ask.ENABLE, Ask.DISABLE):
        return ENABLE_SERVICE, SetBoolRequest(ask is Ask.ENABLE)
    return HOME_SERVICE if ask is Ask.HOME else CLEAR_STOP_SERVICE, TriggerRequest()
