"""Panel of a robot: joint groups, positions, targets, command status; and the grouping of joints.

| key | what it is |
|---|---|
| `kind`, `name` | `robot`, and which |
| `time`, `stamp` | simulation time, and the time that messages carry [ns] |
| `digest` | of `robot` |
| `robot` | what stays as it is (see `RobotPanel.robot`); left out for who knows it already: `{"robot": digest}` |
| `positions`, `targets` | of each joint [rad; m]: measured, null where nobody knows, and what it is given |
| `tips`, `references` | of each arm: world_T_tip, and world_T_reference, in whose frame its poses are commanded |
| `aims` | of each arm: world_T_tip that it is being brought to, or null |
| `grippers`, `gripper_targets` | how far each is closed, 0 to 1, and is to be |
| `base` | world_T_base |
| `enabled`, `stopped`, `homing`, `silent` | whether commands are taken, and what stands against it |
| `held`, `message` | why the robot was held last; what there is to say of it |
| `commander` | the nodes that command it now |
| `taken`, `refused`, `ignored` | how many commands |
| `refusals` | how many were refused, by source: those that were refused most |

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
from cellwright.robot.grippers import gripper_ranges, hand_joints
from cellwright.robot.node import RobotNode
from cellwright.robot.publications import status_of
from cellwright.robot.servos import FARTHEST, Array
from cellwright.util.pose import Pose

_SIDES = ("right", "left")
_LEG = re.compile(r"leg|hip|knee|ankle|foot|toe|thigh|calf", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class JointGroup:
    """Joints that belong together.

    Attributes:
        name: for people: `right arm`, `head`.
        kind: `arm`, `hand`, `head`, `waist`, `lift`, `legs` or `other`.
        joints: their names, in the order of the robot.
        side: which of the arms or hands, right 0, left 1; None for what has no side.
    """

    name: str
    kind: str
    joints: tuple[str, ...]
    side: int | None = None


def side_name(place: int, count: int) -> str:
    """What the arm or gripper at a place of a configuration's list is called; empty for one that is alone."""
    if count == 1:
        return ""
    return _SIDES[place] if place < len(_SIDES) else str(place + 1)


def joint_groups(config: RobotConfig, numbers: Mapping[str, int]) -> tuple[JointGroup, ...]:
    """The groups of a robot; each joint is in one, and a group that would be empty is left out.

    `numbers` holds the joints that can be told where to go, by name, with their place in the robot's order.
    """
    left = set(numbers)
    found = []
    for group in _wanted(config, tuple(numbers)):
        mine = tuple(sorted((name for name in group.joints if name in left), key=lambda name: numbers[name]))
        left.difference_update(mine)
        if mine:
            found.append(JointGroup(group.name, group.kind, mine, group.side))
    return tuple(found)


def _wanted(config: RobotConfig, joints: tuple[str, ...]) -> Iterator[JointGroup]:
    """The groups one after another; a joint goes to the first that names it."""
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


KIND = "robot"

_DIGITS = 5  # behind the point, of joints: 0.01 mm
_FINE = 9  # of poses: who sends one back that was told must not move the hand
_MOST_REFUSALS = 8


class RobotPanel:
    """Tells it of a robot's node. Asking changes nothing."""

    def __init__(self, node: RobotNode) -> None:
        self._node = node
        self._grippers = gripper_ranges(node.config.grippers, node.config.robot, node.commander.numbers)
        config = node.config
        self._tips = [
            config.command_links[place] if place < len(config.command_links) else arm.tip
            for place, arm in enumerate(config.arms)
        ]

    def tell(self, asked: dict[str, Any]) -> dict[str, Any]:
        """The panel as it is now; `asked["robot"]` is the digest of what is known already."""
        node = self._node
        status = status_of(node.commander, node.bus)
        positions = node.driver.read().positions
        references = [node.link_pose(link) for link in node.ee_poses.references]
        most = sorted(node.bus.refusals.counts.items(), key=lambda entry: (-entry[1], entry[0]))
        told: dict[str, Any] = {
            "kind": KIND,
            "name": node.name,
            "time": node.simulation.now,
            "stamp": node.told(),
            "digest": self._digest,
            "positions": _numbers(positions),
            "targets": _numbers(node.commander.applied),
            "tips": [_seven(node.link_pose(link)) for link in self._tips],
            "references": [_seven(pose) for pose in references],
            "aims": [
                None if aim is None else _seven(reference @ aim)
                for reference, aim in zip(references, node.ee_poses.targets, strict=True)
            ],
            "grippers": [round(gripper.status(positions), 3) for gripper in self._grippers],
            "gripper_targets": [round(gripper.status(node.commander.applied), 3) for gripper in self._grippers],
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
            "refusals": dict(most[:_MOST_REFUSALS]),
        }
        if asked.get("robot") != self._digest:
            told["robot"] = self.robot
        return told

    @cached_property
    def robot(self) -> dict[str, Any]:
        """What stays as it is.

        `joints` (`name`, `lower` and `upper` [rad; m] or null, `unit`, `follows`: whether it mimics another), in the
        order of all lists; `groups` of them (`name`, `kind`, `side`, `joints` by number); `arms` (`name`, `tip`,
        `reference`); `grippers`, by name; `base_mode`, or null where the base cannot be moved; `is_real`, whether a
        driver moves it instead of the simulation.
        """
        node, config = self._node, self._node.config
        commander = node.commander
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
                for place, (tip, reference) in enumerate(zip(self._tips, node.ee_poses.references, strict=True))
            ],
            "grippers": [side_name(place, grippers) for place in range(grippers)],
            "base_mode": node.base.mode.value if config.fixed_link is None else None,
            "is_real": node.driver is not node.servos,
        }

    @cached_property
    def _digest(self) -> str:
        return hashlib.sha256(json.dumps(self.robot).encode()).hexdigest()

    def _joint(self, joint: Joint) -> dict[str, Any]:
        limits = joint.limits
        return {
            "name": joint.name,
            "lower": limits.lower if limits.lower > -FARTHEST else None,
            "upper": limits.upper if limits.upper < FARTHEST else None,
            "unit": "m" if joint.type is JointType.PRISMATIC else "rad",
            "follows": joint.name in self._node.commander.mimics.leaders,
        }


def _numbers(values: Array) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in (np.round(values, _DIGITS) + 0.0).tolist()]


def _seven(pose: Pose) -> list[float]:
    return [round(value, _FINE) + 0.0 for value in (*pose.position, *pose.quaternion)]
