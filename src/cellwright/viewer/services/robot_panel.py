"""Panel of a robot: joint groups, positions, targets, command status; and the grouping of joints.

- `kind`, `name`: `robot`, and its name
- `time`, `stamp`: simulation time, and the time in message stamps [ns]
- `digest`: of `robot`
- `robot`: constants, see `RobotPanel.robot`; absent if the request has the digest, as in `{"robot": digest}`
- `positions`, `targets`: of each joint [rad; m]: measured, null where unknown, and target
- `tips`, `references`: of each arm: world_T_tip, and world_T_reference, the frame of its pose commands
- `aims`: of each arm: target of world_T_tip, or null
- `grippers`, `gripper_targets`: closing of each, 0 to 1: measured, and target
- `base`: world_T_base
- `enabled`, `stopped`, `homing`, `silent`: True if commands are on; what stands against them
- `held`, `message`: reason of the last hold; status text
- `commander`: the nodes that command it now
- `taken`, `refused`, `ignored`: counts of commands
- `refusals`: counts of refused commands by source, the largest only

A pose is [x, y, z, qw, qx, qy, qz], in m.
"""

import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Joint, JointType
from cellwright.robot.grippers import hand_joints
from cellwright.robot.node import RobotNode
from cellwright.robot.publications import status_of
from cellwright.robot.servos import MAX_POSITION, Array
from cellwright.util.pose import Pose

_SIDES = ("right", "left")
_LEG = re.compile(r"leg|hip|knee|ankle|foot|toe|thigh|calf", re.IGNORECASE)
KIND = "robot"
_DIGITS = 5  # decimals of joint positions: 0.01 mm
_FINE = 9  # of poses: sending a reported pose back must not move the hand
_MAX_REFUSALS = 8


@dataclass(frozen=True, slots=True)
class JointGroup:
    """Joints that belong together.

    Attributes:
        name: for display: `right arm`, `head`.
        kind: `arm`, `hand`, `head`, `waist`, `lift`, `legs` or `other`.
        joints: their names, in the robot's order.
        side: of an arm or hand, right 0, left 1; None for a group without a side.
    """

    name: str
    kind: str
    joints: tuple[str, ...]
    side: int | None = None


def side_name(place: int, count: int) -> str:
    """Display name of the arm or gripper at this index of the configuration's list; empty for a single one."""
    if count == 1:
        return ""
    return _SIDES[place] if place < len(_SIDES) else str(place + 1)


def joint_groups(config: RobotConfig, numbers: Mapping[str, int]) -> tuple[JointGroup, ...]:
    """Return the groups of a robot, none empty; each joint is in one.

    `numbers` maps each joint that takes targets to its index in the robot's order.
    """
    left = set(numbers)
    found = []
    for group in _candidates(config, tuple(numbers)):
        members = tuple(sorted((name for name in group.joints if name in left), key=lambda name: numbers[name]))
        left.difference_update(members)
        if members:
            found.append(JointGroup(group.name, group.kind, members, group.side))
    return tuple(found)


def _candidates(config: RobotConfig, joints: tuple[str, ...]) -> Iterator[JointGroup]:
    """Yield candidate groups in order; a joint goes to the first that names it."""
    for place, arm in enumerate(config.arms):
        yield JointGroup(f"{side_name(place, len(config.arms))} arm".strip(), "arm", arm.joints, place)
    if config.head is not None:
        yield JointGroup("head", "head", config.head.joints)
    if config.waist is not None:
        yield JointGroup("waist", "waist", config.waist.joints)
    if config.dorsal is not None:
        yield JointGroup("lift", "lift", config.dorsal.joints)
    hands = max(len(config.arms), len(config.grippers))
    for place in range(hands):
        hand = hand_joints(config, place) or ()
        yield JointGroup(f"{side_name(place, hands)} hand".strip(), "hand", tuple(hand), place)
    yield JointGroup("legs", "legs", tuple(name for name in joints if _LEG.search(name)))
    yield JointGroup("other joints", "other", joints)


class RobotPanel:
    """Panel of a robot's node. A request changes nothing."""

    def __init__(self, node: RobotNode) -> None:
        self._node = node

    def state(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the current panel; `request["robot"]` is the digest of the constants that the client has."""
        node = self._node
        status = status_of(node.commander, node.bus)
        positions = node.driver.read().positions
        references = [node.link_pose(link) for link in node.ee_poses.references]
        ranked = sorted(node.bus.refusals.counts.items(), key=lambda entry: (-entry[1], entry[0]))
        panel: dict[str, Any] = {
            "kind": KIND,
            "name": node.name,
            "time": node.simulation.now,
            "stamp": node.message_time(),
            "digest": self._digest,
            "positions": _numbers(positions),
            "targets": _numbers(node.commander.applied),
            "tips": [_seven(node.link_pose(link)) for link in node.ee_poses.tips],
            "references": [_seven(pose) for pose in references],
            "aims": [
                None if aim is None else _seven(reference @ aim)
                for reference, aim in zip(references, node.ee_poses.targets, strict=True)
            ],
            "grippers": [round(gripper.status(positions), 3) for gripper in node.grippers],
            "gripper_targets": [round(gripper.status(node.commander.applied), 3) for gripper in node.grippers],
            "base": _seven(node.base.pose),
            "enabled": status.enabled,
            "stopped": status.emergency_stop,
            "homing": status.resetting,
            "silent": bool(node.commander.watchdog.topics),
            "held": node.commander.why_held,
            "message": status.message,
            "commander": status.commander,
            "taken": status.taken,
            "refused": status.refused,
            "ignored": status.ignored,
            "refusals": dict(ranked[:_MAX_REFUSALS]),
        }
        if request.get("robot") != self._digest:
            panel["robot"] = self.robot
        return panel

    @cached_property
    def robot(self) -> dict[str, Any]:
        """Constants of the robot.

        - `joints`: `name`, `lower` and `upper` [rad; m] or null, `unit`, and `follows`, True if it mimics another. All
          lists have this order.
        - `groups`: `name`, `kind`, `side`, and `joints` by number.
        - `arms`: `name`, `tip`, `reference`.
        - `grippers`: names.
        - `base_mode`: null if the base cannot move.
        - `is_real`: True if a driver moves the robot instead of the simulation.
        """
        node, config = self._node, self._node.config
        commander, poses = node.commander, node.ee_poses
        free = {name: number for name, number in commander.numbers.items() if name not in commander.mimics.leaders}
        arms, grippers = len(config.arms), len(config.grippers)
        return {
            "joints": [self._joint(config.robot.joint(name)) for name in node.driver.joints],
            "groups": [
                {
                    "name": group.name,
                    "kind": group.kind,
                    "side": group.side,
                    "joints": [commander.numbers[name] for name in group.joints],
                }
                for group in joint_groups(config, free)
            ],
            "arms": [
                {"name": side_name(place, arms), "tip": tip, "reference": reference}
                for place, (tip, reference) in enumerate(zip(poses.tips, poses.references, strict=True))
            ],
            "grippers": [side_name(place, grippers) for place in range(grippers)],
            "base_mode": node.base.mode.value if config.fixed_link is None else None,
            "is_real": node.has_driver,
        }

    @cached_property
    def _digest(self) -> str:
        return hashlib.sha256(json.dumps(self.robot).encode()).hexdigest()

    def _joint(self, joint: Joint) -> dict[str, Any]:
        limits = joint.limits
        return {
            "name": joint.name,
            "lower": limits.lower if limits.lower > -MAX_POSITION else None,
            "upper": limits.upper if limits.upper < MAX_POSITION else None,
            "unit": "m" if joint.type is JointType.PRISMATIC else "rad",
            "follows": joint.name in self._node.commander.mimics.leaders,
        }


def _numbers(values: Array) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in (np.round(values, _DIGITS) + 0.0).tolist()]


def _seven(pose: Pose) -> list[float]:
    return [round(value, _FINE) + 0.0 for value in (*pose.position, *pose.quaternion)]
