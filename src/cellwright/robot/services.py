"""Services of a robot beside its topics, with JSON in and out, for windows and for assembled robots."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from cellwright.clients.assembled import process
from cellwright.config.robot.config import Posture
from cellwright.config.robot.model import Joint
from cellwright.middleware.server.requests import Extra
from cellwright.robot.commands import MAX_ENTRIES
from cellwright.robot.node import RobotNode
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose


class Offers(Protocol):
    """Registry of services: a server, or a program that calls them itself."""

    def offer(self, service: str, handler: Extra, *, acts: bool = False) -> None:
        """Register a service; see `Server.offer`."""


class RobotServices:
    """Services of a robot. Joints and links go by index, poses are [[x, y, z], [qx, qy, qz, qw]] in the world."""

    def __init__(self, node: RobotNode) -> None:
        self._node = node
        self._robot = node.config.robot
        numbers = node.commander.numbers
        self._numbers = {self._robot.joint_indices[name]: number for name, number in numbers.items()}
        movable = [joint.name for joint in self._robot.movable]
        self._places = [movable.index(name) for name in node.servos.joints]

    def offer(self, server: Offers) -> None:
        """Offer all services on a server, including those that move the robot beside its topics."""
        self.offer_state(server)
        server.offer(process.DESCRIBE_SERVICE, self.describe)
        server.offer(process.MOVE_SERVICE, self.move, acts=True)
        server.offer(process.PLACE_SERVICE, self.place, acts=True)
        server.offer(process.MOVE_TIP_SERVICE, self.move_tip, acts=True)
        server.offer(process.PLACE_BASE_SERVICE, self.place_base, acts=True)

    def offer_state(self, server: Offers) -> None:
        """Offer the services that only read the robot's state."""
        server.offer(process.STATE_SERVICE, self.state)

    def describe(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return a description of the robot in its initial posture."""
        config, link_indices = self._node.config, self._robot.link_indices
        return {
            "name": config.name,
            "joints": [self._describe_joint(index, joint) for index, joint in enumerate(self._robot.joints)],
            "arms": [
                {
                    "joints": self._indices(arm.joints),
                    "tip": link_indices[arm.tip],
                    "home": list(arm.home),
                    "home_pose": self._link_pose(link_indices[arm.tip]),
                }
                for arm in config.arms
            ],
            "grippers": [
                {
                    "joints": self._indices(gripper.joints),
                    "follows": [self._robot.joint(name).mimic is not None for name in gripper.joints],
                    "ways": [gripper.open_and_closed(self._robot.joint(name)) for name in gripper.joints],
                }
                for gripper in config.grippers
            ],
            "head": None if config.head is None else {**self._posture(config.head), "axes": list(config.head_axes)},
            "dorsal": None if config.dorsal is None else self._posture(config.dorsal),
            "waist": None if config.waist is None else self._posture(config.waist),
        }

    def state(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return joints, base pose, targets of driven joints, and poses of the requested links.

        Poses of links are in the world, or in the frame of the link with the index `frame`.

        Raises:
            RejectedCommandError: `links` is no list of indices, or too long, or there is no such link.
        """
        links = request.get("links", [])
        if not isinstance(links, list) or len(links) > MAX_ENTRIES:
            raise RejectedCommandError(f"links must be a list of at most {MAX_ENTRIES} indices")
        readings = self._node.driver.read()
        columns = np.zeros((3, len(self._robot.movable)))  # 0 for joints of more than one degree of freedom
        columns[:, self._places] = readings
        return {
            "driven": readings.positions.tolist(),
            "targets": self._node.commander.applied.tolist(),
            "carrier": [*self._node.base.pose.position, *self._node.base.pose.quaternion],
            **dict(zip(("positions", "velocities", "efforts"), columns.tolist(), strict=True)),
            "links": [self._link_pose(index, request.get("frame")) for index in links],
        }

    def move(self, request: dict[str, Any]) -> dict[str, Any]:
        """Move joints to positions."""
        self._node.commander.set_targets(*self._targets(request))
        return {}

    def place(self, request: dict[str, Any]) -> dict[str, Any]:
        """Place joints at positions at once."""
        numbers, positions = self._targets(request)
        self._node.servos.place(numbers, positions)
        self._node.commander.set_targets(numbers, positions)
        return {}

    def move_tip(self, request: dict[str, Any]) -> dict[str, Any]:
        """Move the tip of an arm to a pose; the other arms are not affected.

        Raises:
            RejectedCommandError: there is no such arm, the pose is invalid, or the robot takes no commands now.
        """
        arm, world_T_tip = request.get("arm"), _requested_pose(request)
        references = self._node.ee_poses.references
        if not isinstance(arm, int) or not 0 <= arm < len(references):
            raise RejectedCommandError(f"unknown arm {arm!r} (known: {', '.join(map(str, range(len(references))))})")
        self._check_takes_commands()
        world_T_reference = self._pose(self._robot.link_indices[references[arm]])
        poses: list[Pose | None] = [None] * len(references)
        poses[arm] = world_T_reference.inverse() @ world_T_tip
        self._node.ee_poses.aim(poses)
        return {}

    def place_base(self, request: dict[str, Any]) -> dict[str, Any]:
        """Place the root link: this moves the base, which may be fixed to another link."""
        world_T_root = _requested_pose(request)
        self._check_takes_commands()
        base = self._node.base
        base.place(world_T_root @ self._pose(-1).inverse() @ base.pose)
        return {}

    def _check_takes_commands(self) -> None:
        commander = self._node.commander
        if commander.why_ignored:
            why = commander.why_held or "they are disabled, or the robot is on its way home"
            raise RejectedCommandError(f"the robot takes no commands now: {why}")

    def _targets(self, request: dict[str, Any]) -> tuple[list[int], list[float]]:
        indices, positions = request.get("joints"), request.get("positions")
        if not isinstance(indices, list) or not isinstance(positions, list) or len(indices) != len(positions):
            raise RejectedCommandError("joints and positions must be lists of the same length")
        if len(indices) > MAX_ENTRIES:
            raise RejectedCommandError(f"at most {MAX_ENTRIES} joints are allowed (got {len(indices)})")
        for index, position in zip(indices, positions, strict=True):
            if not isinstance(index, int) or index not in self._numbers:
                raise RejectedCommandError(f"no movable joint with the index {index!r}")
            if not isinstance(position, (int, float)) or not math.isfinite(position):
                raise RejectedCommandError(f"a position must be a finite number (got {position!r})")
        self._check_takes_commands()
        return [self._numbers[index] for index in indices], [float(position) for position in positions]

    def _describe_joint(self, index: int, joint: Joint) -> dict[str, Any]:
        limits = joint.limits
        named = {"lower": limits.lower, "upper": limits.upper, "effort": limits.effort, "velocity": limits.velocity}
        return {
            "index": index,
            "name": joint.name,
            "type": joint.type.value,
            "link": joint.child,
            "parent": joint.parent,
            "is_driven": joint.is_driven,
            **{key: value if math.isfinite(value) else None for key, value in named.items()},
        }

    def _indices(self, names: Sequence[str]) -> list[int]:
        return [self._robot.joint_indices[name] for name in names]

    def _posture(self, posture: Posture) -> dict[str, Any]:
        return {"joints": self._indices(posture.joints), "home": list(posture.home)}

    def _link_pose(self, index: Any, frame: Any = None) -> list[list[float]]:
        pose = self._pose(index) if frame is None else self._pose(frame).inverse() @ self._pose(index)
        w, x, y, z = pose.quaternion
        return [list(pose.position), [x, y, z, w]]

    def _pose(self, index: Any) -> Pose:
        if not isinstance(index, int) or not -1 <= index < len(self._robot.joints):
            raise RejectedCommandError(f"no link with the index {index!r}")
        return self._node.link_pose(self._robot.link_at(index))


def _requested_pose(request: dict[str, Any]) -> Pose:
    """Return the pose in a request, with a unit quaternion."""
    try:
        (x, y, z), (qx, qy, qz, qw) = request["pose"]
        length = math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
        pose = Pose((x, y, z), (qw / length, qx / length, qy / length, qz / length))
        is_finite = math.isfinite(x + y + z + length)
    except (KeyError, TypeError, ValueError, ArithmeticError):
        is_finite = False
    if not is_finite:
        raise RejectedCommandError("a pose must be [[x, y, z], [qx, qy, qz, qw]] with finite numbers")
    return pose
