"""Targets of a cell's channels from the numbers of an action, by a map.

Steps go from the last targets, not from measured values: soft servos give way to the arm's weight, and a policy that
adds to what is measured would sink with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.clients.policies.key_map import KeyMap, Part, Skip, ToChannels, ToGripper, ToTool, size_of
from cellwright.clients.policies.rotations import SIZES, rotation_of, rotation_vector
from cellwright.config.control import Channel, ControlSpace
from cellwright.motion.chain import Chain
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, normalized, quaternion_product

_DAMPING = 0.02
"""Damping of inverse kinematics [m; rad]: near a singularity it trades exactness for small motions of the joints."""
_MAX_ITERATIONS = 30
_NEAR = 1e-6  # [m; rad] at which the tool is at its pose
_LEAST = 1e-12
_LARGEST = 0.2  # [rad; m] of a joint in one iteration


@dataclass(frozen=True)
class ToolArm:
    """An arm whose tool is commanded.

    Attributes:
        chain: the arm, from the frame of its mount.
        world_T_begin: that frame; where joints move it, the frame in which the `mount` begins.
        places: places of the arm's joints among the channels.
        mount: chain from there to the arm's first frame, such as a robot's lift; None if nothing moves that.
        mount_places: places of its joints among the channels.
    """

    chain: Chain
    world_T_begin: Pose
    places: tuple[int, ...]
    mount: Chain | None = None
    mount_places: tuple[int, ...] = ()

    def base_T_tool(self, values: Sequence[float]) -> Pose:
        """Return the pose of the tool at the values of all channels."""
        return self.chain.tool([values[place] for place in self.places])

    def world_T_base(self, values: Sequence[float]) -> Pose:
        """Return the frame of the arm's mount at the values of all channels."""
        if self.mount is None:
            return self.world_T_begin
        return self.world_T_begin @ self.mount.tool([values[place] for place in self.mount_places])


class Targets:
    """Targets of all channels, action by action.

    Args:
        key_map: the map.
        space: the channels.
        arms: arms whose tools the map commands, by name.

    Attributes:
        values: the last targets.
    """

    def __init__(self, key_map: KeyMap, space: ControlSpace, arms: Mapping[str, ToolArm]) -> None:
        self._map, self._space, self._arms = key_map, space, arms
        self.values: list[float] = [0.0] * len(space.channels)

    def begin(self, values: Sequence[float]) -> None:
        """Begin at these values of the channels."""
        self.values = list(values)

    def take(self, action: NDArray[np.float64]) -> list[float]:
        """Return the targets of an action, each within its channel's range; the next action may go on from them.

        Args:
            action: shape (D,), as many numbers as the map has.

        Raises:
            UsageError: it has another number of values, or some that are no rotation.
        """
        if action.shape != (self._map.size,):
            raise UsageError(
                f"an action must have {self._map.size} numbers (got {action.size}); compare the policy's "
                "with actions in the map"
            )
        values, begin = list(self.values), 0
        for part in self._map.actions:
            numbers = [float(each) for each in action[begin : begin + size_of(part)]]
            begin += len(numbers)
            self._apply(part, numbers, values)
        self.values = self._space.targets(values)
        return self.values

    def _apply(self, part: Part, numbers: Sequence[float], values: list[float]) -> None:
        match part:
            case ToChannels(names, steps, scale, offset, limit):
                for name, number in zip(names, _clipped(numbers, limit), strict=True):
                    place = self._space.index(name)
                    values[place] = (values[place] if steps else 0.0) + number * scale + offset
            case ToGripper():
                place = self._space.index(part.name)
                values[place] = value_of_share(self._space.channels[place], part.share(numbers[0]))
            case ToTool():
                arm = self._arms[part.arm]
                found = solve(arm, _tool_target(part, arm, numbers, values), values)
                for place, value in zip(arm.places, found, strict=True):
                    values[place] = value
            case Skip():
                pass


def value_of_share(channel: Channel, share: float) -> float:
    """Return the value of a gripper's channel that is closed by a share from 0 to 1; a suction that is on is closed.

    Example:
        >>> value_of_share(Channel("width", "width", "m", 0.0, 0.08), 1.0)
        0.0
    """
    return channel.high - share * (channel.high - channel.low) if channel.kind == "width" else share


def share_of_value(channel: Channel, value: float) -> float:
    """Return the share from 0 to 1 by which a gripper is closed, by the value of its channel."""
    return (channel.high - value) / (channel.high - channel.low) if channel.kind == "width" else value


def _clipped(numbers: Sequence[float], limit: float) -> list[float]:
    return [min(max(each, -limit), limit) for each in numbers]


def _tool_target(part: ToTool, arm: ToolArm, numbers: Sequence[float], values: Sequence[float]) -> Pose:
    """Return base_T_tool that a part of an action asks for."""
    numbers = _clipped(numbers, part.limit)
    x, y, z = (part.scale * each for each in numbers[:3])
    rotation = rotation_of(numbers[3:], part.rotation)
    present = arm.base_T_tool(values)
    if not part.steps:
        given = Pose((x, y, z), rotation)
        target = arm.world_T_base(values).relative(given) if part.frame == "world" else given
        return target if SIZES[part.rotation] else Pose(target.position, present.quaternion)
    turn = rotation_of([part.turn_scale * each for each in rotation_vector(rotation)], "axis_angle")
    if part.frame == "tool":
        return present @ Pose((x, y, z), turn)
    axes = arm.world_T_base(values).inverse() if part.frame == "world" else Pose()
    px, py, pz = present.position
    dx, dy, dz = axes.rotate((x, y, z))
    # along and about the axes of base or world, and not those of the tool: the turn comes from the left
    w, *axis = turn
    turned = (w, *axes.rotate((axis[0], axis[1], axis[2])))
    return Pose((px + dx, py + dy, pz + dz), normalized(quaternion_product(turned, present.quaternion)))


def solve(arm: ToolArm, base_T_tool: Pose, values: Sequence[float]) -> list[float]:
    """Return the positions near the present ones that bring the tool to a pose, or as near as limits and reach allow.

    Damped least squares (Wampler 1986), from the last targets: an action moves the tool by little.
    """
    joints = arm.chain.joints
    q = np.array([values[place] for place in arm.places])
    lower, upper = np.array([each.lower for each in joints]), np.array([each.upper for each in joints])
    for _ in range(_MAX_ITERATIONS):
        present = arm.chain.tool(q.tolist())
        turn = present.relative(Pose((0.0, 0.0, 0.0), base_T_tool.quaternion)).quaternion
        way = np.subtract(base_T_tool.position, present.position)
        error = np.concatenate((way, present.rotate(rotation_vector(normalized(turn)))))
        if float(np.abs(error).max()) < _NEAR:
            break
        jacobian = arm.chain.jacobian(q.tolist())
        # less damping near the goal, so that the last iterations are exact (Chan and Lawrence 1988)
        damping = _DAMPING**2 * min(1.0, float(np.dot(error, error))) + _LEAST
        step: NDArray[np.float64] = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping * np.eye(6), error)
        step *= min(1.0, _LARGEST / max(float(np.abs(step).max()), _LEAST))
        q = np.clip(q + step, lower, upper)
    return [float(each) for each in q]
