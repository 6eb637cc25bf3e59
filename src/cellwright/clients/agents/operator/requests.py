"""Requests of an operator: the topics, and what their messages ask of an arm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias

from cellwright.middleware.messages.conversions import header, joint_state, pose_from_message, pose_message
from cellwright.middleware.messages.standard import JointState, PoseStamped, Twist, TwistStamped
from cellwright.middleware.messages.standard import Vector3 as VectorMessage
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose, Vector3

POSE = "/cellwright/operator/pose"
"""Pose that the tool of the chosen arm is to go to, in the world (geometry_msgs/PoseStamped)."""
VELOCITY = "/cellwright/operator/velocity"
"""Velocity of that tool, along the axes of `world` or `tool` (geometry_msgs/TwistStamped)."""
JOINTS = "/cellwright/operator/joints"
"""Positions that joints of any arm are to go to, or their velocities (sensor_msgs/JointState)."""
COMMAND = "/cellwright/operator/command"
"""A command in words, such as `home` (std_msgs/String)."""
REPORT = "/cellwright/operator/report"
"""State of the operator agent, as a JSON object (std_msgs/String)."""
REQUESTS = (POSE, VELOCITY, JOINTS, COMMAND)

MAX_DISTANCE = 50.0
"""Largest distance [m] of a requested pose from the origin: one farther away is a mistake."""
WORLD: Final = "world"
TOOL: Final = "tool"
ON, OFF = "on", "off"
COMMANDS: Mapping[str, tuple[str, ...]] = {
    "start": ("",),
    "stop": ("",),
    "clear": ("",),
    "home": ("",),
    "hold": ("",),
    "snap": ("",),
    "upright": (ON, OFF),
    "belt": (ON, OFF),
}
"""Commands with the words that may follow; `arm` is followed by the name of an arm."""

Frame: TypeAlias = Literal["world", "tool"]


@dataclass(frozen=True, slots=True)
class ToPose:
    """The tool is to go to a pose, world_T_tool."""

    world_T_tool: Pose


@dataclass(frozen=True, slots=True)
class Velocity:
    """The tool is to move at a velocity, along and about the axes of a frame [m/s, rad/s]."""

    linear: Vector3
    angular: Vector3
    frame: Frame = WORLD


@dataclass(frozen=True, slots=True)
class ToJoints:
    """Joints are to go to positions [rad; m], by name."""

    positions: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class JointVelocity:
    """Joints are to move at velocities [rad/s; m/s], by name."""

    velocities: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Command:
    """A command: its name, and the word behind it."""

    name: str
    word: str = ""


Request: TypeAlias = ToPose | Velocity | ToJoints | JointVelocity | Command


def read_request(topic: str, message: Any) -> Request:
    """Return the request of a message.

    Raises:
        MessageError: it asks for nothing that an arm can do.

    Example:
        >>> from cellwright.middleware.messages.standard import String
        >>> read_request(COMMAND, String("upright off"))
        Command(name='upright', word='off')
    """
    if topic == POSE:
        return _pose(message)
    if topic == VELOCITY:
        return _velocity(message)
    if topic == JOINTS:
        return _joints(message)
    return _command(str(message.data))


def pose_request(world_T_tool: Pose) -> PoseStamped:
    """Return the message that asks for a pose of the tool in the world."""
    return PoseStamped(header(WORLD), pose_message(world_T_tool))


def velocity_request(linear: Vector3, angular: Vector3 = (0.0, 0.0, 0.0), frame: Frame = WORLD) -> TwistStamped:
    """Return the message that asks for a velocity of the tool [m/s, rad/s]."""
    return TwistStamped(header(frame), Twist(VectorMessage(*linear), VectorMessage(*angular)))


def joints_request(
    positions: Mapping[str, float] | None = None, velocities: Mapping[str, float] | None = None
) -> JointState:
    """Return the message that asks for positions [rad; m] or velocities [rad/s; m/s] of joints, by name."""
    if velocities is not None:
        return joint_state(list(velocities), (), list(velocities.values()))
    return joint_state(list(positions or ()), list((positions or {}).values()))


def _pose(message: PoseStamped) -> ToPose:
    frame = message.header.frame_id
    if frame not in ("", WORLD):
        raise MessageError(f"pose: frame_id must be {WORLD} (got {frame:.40}); transform the pose into it")
    pose = pose_from_message(message.pose)
    if max(map(abs, pose.position)) > MAX_DISTANCE:
        raise MessageError(f"pose: must be within {MAX_DISTANCE:g} m (got {pose.position})")
    return ToPose(pose)


def _velocity(message: TwistStamped) -> Velocity:
    frame = message.header.frame_id or WORLD
    if frame not in (WORLD, TOOL):
        raise MessageError(f"velocity: frame_id must be {WORLD} or {TOOL} (got {frame:.40})")
    linear, angular = message.twist.linear, message.twist.angular
    found = (linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z)
    if not all(map(math.isfinite, (*found[0], *found[1]))):
        raise MessageError(f"velocity: must be finite (got {found[0]} and {found[1]})")
    return Velocity(*found, frame=TOOL if frame == TOOL else WORLD)


def _joints(message: JointState) -> ToJoints | JointVelocity:
    names = [str(each) for each in message.name]
    are_positions = len(message.position) > 0
    values = [float(each) for each in (message.position if are_positions else message.velocity)]
    if not names or len(values) != len(names) or (are_positions and len(message.velocity)):
        raise MessageError(
            f"joints: must have a position or a velocity for each name (got {len(names)} names, "
            f"{len(message.position)} positions, {len(message.velocity)} velocities)"
        )
    if not all(map(math.isfinite, values)):
        raise MessageError(f"joints: must be finite (got {values})")
    found = dict(zip(names, values, strict=True))
    return ToJoints(found) if are_positions else JointVelocity(found)


def _command(text: str) -> Command:
    name, _, word = " ".join(text[:200].split()).partition(" ")
    if name == "arm" and word:
        return Command(name, word)
    if word not in COMMANDS.get(name, ()):
        known = [f"{each} {'|'.join(words)}".strip() for each, words in COMMANDS.items()]
        raise MessageError(f"command: unknown (got {text[:40]!r}); give one of {', '.join(known)}, arm NAME")
    return Command(name, word)
