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
from cellwright.middleware.messages import conversions, message_type
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

_LIMIT_SLACK = 2e-3  # [rad; m] that a joint that was measured at its limit may lie outside; the node cuts it off

_UNKNOWN_LIMITS = Limits()


@dataclass(frozen=True)
class JointLimits:
    """Limits by joint; a joint that is not there has none that anybody knows."""

    joints: Mapping[str, Limits] = field(default_factory=dict)
    source: str = ""
    """Where they are from, for people; empty where nothing is known."""

    @classmethod
    def of(cls, robot: RobotModel) -> JointLimits:
        """Those of a robot's description."""
        return cls({joint.name: joint.limits for joint in robot.driven}, robot.name)

    def of_joint(self, name: str) -> Limits:
        """The limits of a joint, infinite where nothing is known."""
        return self.joints.get(name, _UNKNOWN_LIMITS)

    def clamped(self, name: str, position: float) -> float:
        """A position [rad; m] within the limits of a joint."""
        limits = self.of_joint(name)
        return min(max(position, limits.lower), limits.upper)

    def check(self, name: str, low: float, high: float, what: str) -> None:
        """Refuse what would take a joint from `low` to `high` [rad; m], out of its limits, by a UsageError."""
        limits = self.of_joint(name)
        if low < limits.lower - _LIMIT_SLACK or high > limits.upper + _LIMIT_SLACK:
            raise UsageError(
                f"{name}: {what} would go from {low:.4g} to {high:.4g}, and its limits ({self.source}) are "
                f"{limits.lower:.4g} to {limits.upper:.4g}"
            )

    @property
    def is_known(self) -> bool:
        """Whether anything is known."""
        return any(math.isfinite(limit.upper - limit.lower) for limit in self.joints.values())


@dataclass(frozen=True, slots=True)
class MoveJoints:
    """Joints are to go to positions [rad; m]; `topic` takes commands of joints."""

    targets: Mapping[str, float]
    topic: str = JOINT_COMMAND


@dataclass(frozen=True, slots=True)
class MoveTips:
    """The tip of each arm is to go to a pose, base_T_tip: right, left."""

    tips: tuple[Pose, ...]


@dataclass(frozen=True, slots=True)
class MoveGrippers:
    """Each gripper is to be so far closed, 0 to 1: right, left."""

    closed: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class MoveBase:
    """The base is to move: two or three numbers, as `BaseMode` in `cellwright.config.robot.config` says."""

    numbers: tuple[float, ...]


class Ask(Enum):
    """A service that is to be called."""

    HOME = "home"
    ENABLE = "enable"
    DISABLE = "disable"
    CLEAR_STOP = "clear the emergency stop"


class Now(Enum):
    """What comes before all else."""

    STOP = "emergency stop"
    QUIT = "quit"


Order: TypeAlias = MoveJoints | MoveTips | MoveGrippers | Ask | Now


def command_message(order: MoveJoints | MoveTips | MoveGrippers | MoveBase | Now, time: int) -> tuple[str, Any]:
    """The topic that an order goes to, and its message, stamped with `time` [ns] of the node's clock."""
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
            array, layout = (message_type(f"std_msgs/{name}") for name in ("Float64MultiArray", "MultiArrayLayout"))
            return BASE_COMMAND, array(layout=layout(dim=[], data_offset=0), data=conversions.floats(order.numbers))  # type: ignore[call-arg]
        case Now():
            return EMERGENCY_STOP, Bool(True)


FIRST_STATES_TIMEOUT = 5.0
"""So long [s] the first joint states are waited for."""

SETTLE = 0.5
"""So long [s] the other topics have to say something first; they are told 100 times a second."""

_STOPPED, _DISABLED = "its emergency stop is on", "it is not enabled"


class OperatedRobot:
    """A robot's node.

    Only joint states must be there; a node of somebody else's may say nothing of grippers, tips or status.

    Raises:
        UsageError: nothing is heard of a robot.
    """

    def __init__(self, session: NodeClient) -> None:
        self.session = session
        self._told = (0, 0)  # joint states heard, and how far the node's clock is ahead of the session's [ns]
        self._stamp = 0
        self.sent = 0
        """How many messages it was sent."""
        self._states = session.latest(JOINT_STATES)
        self._applied = session.latest("/io_teleop/applied_joint_cmd")
        self._grippers = session.latest("/io_teleop/gripper_states")
        self._tips = session.latest("/io_teleop/state_ee_poses")
        self._status = session.latest("/io_teleop/status")
        if self._states.wait(FIRST_STATES_TIMEOUT) is None:
            raise UsageError(f"nothing comes on {JOINT_STATES}: is it a robot's controller node that runs there?")
        others = (self._applied, self._grippers, self._tips, self._status)
        session.wait_until(lambda: all(topic.message is not None for topic in others), SETTLE)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all joints that are not fixed, as the node orders them."""
        return tuple(self._states.message.name)

    @property
    def positions(self) -> dict[str, float]:
        """Where the joints are [rad; m], as last heard."""
        return by_name(self._states.message)

    def position(self, joint: str) -> float:
        """Where a joint is [rad; m], as last heard; a UsageError where the node does not say."""
        try:
            return self.positions[joint]
        except KeyError:
            raise UsageError(f"the node does not say where {joint} is") from None

    @property
    def applied(self) -> dict[str, float]:
        """Where the node really has them go [rad; m], as last heard; empty where it does not say."""
        return by_name(self._applied.message)

    @property
    def grippers(self) -> tuple[float, ...]:
        """How far each gripper is closed, 0 to 1, as last heard; empty where the node does not say."""
        message = self._grippers.message
        return () if message is None else tuple(map(float, message.position))

    @property
    def tips(self) -> tuple[Pose, ...]:
        """Where the tip of each arm is: base_T_tip, as last heard; empty where the node does not say."""
        message = self._tips.message
        return () if message is None else tuple(map(conversions.pose_from_message, message.poses))

    @property
    def status(self) -> Any:
        """What the node takes and refuses (cellwright_msgs/TeleopStatus), as last heard; None where it does not say."""
        return self._status.message

    def why_not(self) -> str:
        """Why the node would not take commands now; empty when it would, or does not say."""
        status = self.status
        if status is None:
            return ""
        if status.emergency_stop:
            return _STOPPED
        if status.resetting:
            return "it is on its way home"
        return "" if status.enabled else _DISABLED

    def check_ready(self) -> None:
        """Refuse a node that would take no commands, by a UsageError that says why, and what ends that."""
        reason = self.why_not()
        if reason:
            word = {_STOPPED: "clear-stop", _DISABLED: "enable"}.get(reason, "")
            hint = f"; to change that: cellwright operate call {word}" if word else ""
            raise UsageError(f"the robot takes no commands: {reason}{hint}")

    def check_names(self, names: Iterable[str]) -> None:
        """Refuse joints that it has not, by an UnknownNameError with the names that there are."""
        for name in names:
            if name not in self.joints:
                raise UnknownNameError("joint", name, self.joints)

    def send(self, order: MoveJoints | MoveTips | MoveGrippers | MoveBase | Now) -> None:
        """Send a command; after an emergency stop the node takes no others until that is cleared."""
        self.session.publish(*command_message(order, self._now()))
        self.sent += 1

    def _now(self) -> int:
        """The time by the node's clock [ns], as its joint states tell it: a command's age may be looked at."""
        now = self.session.transport.now()
        if self._states.count != self._told[0]:
            stamp = conversions.nanoseconds(self._states.message.header.stamp)
            self._told = (self._states.count, (stamp or now) - now)
        self._stamp = max(self._stamp, now + self._told[1])
        return self._stamp


def by_name(message: Any) -> dict[str, float]:
    """The finite positions in a message of joints; of none, nothing."""
    if message is None:
        return {}
    values = zip(message.name, map(float, message.position), strict=False)  # strangers may send what they like
    return {name: value for name, value in values if math.isfinite(value)}


HOME_SERVICE = "/io_teleop_reset_robot"
ENABLE_SERVICE = "/io_teleop/set_enabled"
CLEAR_STOP_SERVICE = "/io_teleop/clear_emergency_stop"


class ServiceCaller:
    """Calls one service at a time, in a thread, over a connection that `open_session` makes there when it is needed."""

    def __init__(self, open_session: Callable[[], NodeClient]) -> None:
        self._open = open_session
        self._session: NodeClient | None = None
        self._thread: threading.Thread | None = None
        self._answer = ""
        self.under_way = ""
        """What is being waited for; empty if nothing is."""

    def begin(self, ask: Ask) -> bool:
        """Call a service; False if another is still being waited for."""
        if self._thread is not None:
            return False
        self.under_way = ask.value
        self._thread = threading.Thread(target=self._call, args=(ask,), daemon=True)
        self._thread.start()
        return True

    def answer(self) -> str:
        """What a service has answered, in a sentence, once; empty while there is nothing new."""
        if self._thread is None or self._thread.is_alive():
            return ""
        self._thread, self.under_way = None, ""
        return self._answer

    def close(self) -> None:
        """Let go of the connection; an answer that is still to come is not waited for."""
        if self._session is not None:
            self._session.close()

    def _call(self, ask: Ask) -> None:
        try:
            self._session = self._session or self._open()
            self._session.adopt()  # each call has a thread of its own, one after the other
            response = self._session.call(*service_request(ask))
            outcome = "done" if response.success else "refused"
            answer = f"{outcome}; {response.message}" if response.message else outcome
        except (CellwrightError, RunEndedError) as error:
            answer = str(error)
        except Exception as error:  # the operator waits for an answer, and a thread that dies gives none
            answer = f"failed: {type(error).__name__}: {error}"
        self._answer = f"{ask.value}: {answer}"


def service_request(ask: Ask) -> tuple[str, Any]:
    """The service that is meant, and what it is asked."""
    if ask in (Ask.ENABLE, Ask.DISABLE):
        return ENABLE_SERVICE, SetBoolRequest(ask is Ask.ENABLE)
    return HOME_SERVICE if ask is Ask.HOME else CLEAR_STOP_SERVICE, TriggerRequest()
