"""Command topics and services of the robot's node: validated messages, converted to targets."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partialmethod
from typing import Any

import numpy as np

from cellwright.config.robot.config import BaseMode, RobotConfig
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.middleware.messages.std_srvs import SetBoolRequest, SetBoolResponse, TriggerRequest, TriggerResponse
from cellwright.robot.base import MODE, Base
from cellwright.robot.commander import Commander
from cellwright.robot.grippers import LEFT, RIGHT, GripperRange, hand_joints
from cellwright.robot.servos import Array
from cellwright.util.errors import RejectedCommandError

MAX_ENTRIES = 4096
"""Maximum entries of a message: more than any robot has joints."""


class NamedJoints:
    """Joints that a list of names means on a topic.

    A stream names the same joints in each message, so the newest list is kept with its meaning.

    Args:
        numbers: number of each joint that this topic moves, by name.

    Attributes:
        names: the list.
        joints: numbers of the known joints, in its order.
        places: their places in the list.
    """

    def __init__(self, numbers: Mapping[str, int]) -> None:
        self._numbers = numbers
        self.names: list[str] = []
        self.joints = self.places = np.zeros(0, dtype=np.intp)

    def read(self, message: Any) -> Array:
        """Take the list of a message; return its positions [rad; m].

        Raises:
            RejectedCommandError: the message is invalid; the text says why.
        """
        names: list[str] = message.name
        positions: Array = message.position
        count = len(positions)
        if len(names) > MAX_ENTRIES or count > MAX_ENTRIES:
            raise RejectedCommandError(f"at most {MAX_ENTRIES} entries are allowed (got {max(len(names), count)})")
        if len(names) != count:
            raise RejectedCommandError(f"name and position must have the same length (got {len(names)} and {count})")
        if names != self.names:
            self._learn(names)
        # A sum of finite numbers may be infinite.
        if not math.isfinite(sum(positions.tolist())):
            for name, position in zip(names, positions.tolist(), strict=True):
                if not math.isfinite(position):
                    raise RejectedCommandError(f"the position of {name!r:.80} must be finite (got {position})")
        return positions

    def _learn(self, names: list[str]) -> None:
        """Keep a list; a RejectedCommandError if it names a joint twice."""
        if len(set(names)) != len(names):
            # In one pass: the message is untrusted, and physics waits.
            counts = Counter(names)
            duplicate = next(name for name in names if counts[name] > 1)
            raise RejectedCommandError(f"{duplicate!r:.80} appears twice; give each name once")
        known = [(self._numbers[name], place) for place, name in enumerate(names) if name in self._numbers]
        self.joints = np.array([number for number, _ in known], dtype=np.intp)
        self.places = np.array([place for _, place in known], dtype=np.intp)
        self.names = list(names)  # the sender may change its own


def gripper_statuses(message: Any, count: int) -> list[float]:
    """Return the status of each of `count` grippers; names are ignored, and surplus numbers cut off.

    Raises:
        RejectedCommandError: there are fewer numbers than grippers, or some are not finite.
    """
    length = len(message.position)
    if length > MAX_ENTRIES:
        raise RejectedCommandError(f"at most {MAX_ENTRIES} entries are allowed (got {length})")
    if length < count:
        raise RejectedCommandError(f"position must have {count} numbers, one a gripper (right, left; got {length})")
    values: list[float] = message.position.tolist()
    if not all(map(math.isfinite, values)):
        raise RejectedCommandError(f"a gripper's status must be from 0 to 1 (got {values[:8]})")
    return values[:count]


class RobotCommands:
    """Handlers of the topics and services that clients send to; grippers are right, left."""

    def __init__(self, config: RobotConfig, commander: Commander, grippers: Sequence[GripperRange]) -> None:
        self._config, self._commander, self._grippers = config, commander, tuple(grippers)
        self._hands = {side: hand_joints(config, side) for side in (RIGHT, LEFT)}
        moved = {name: number for name, number in commander.numbers.items() if name not in commander.mimics.leaders}
        self._named: dict[int | None, NamedJoints] = {None: NamedJoints(moved)}
        for side, hand in self._hands.items():
            of_hand = {name: number for name, number in moved.items() if hand is None or name in hand}
            self._named[side] = NamedJoints(of_hand)

    def _follow(self, row: Endpoint, message: Any, node: str, *, hand: int | None = None) -> None:
        """Follow targets of joints, either of one hand or of any."""
        topic, named, commander = row.name, self._named[hand], self._commander
        positions, stamp = named.read(message), nanoseconds(message.header.stamp)
        if not commander.admit(topic, node, stamp):
            return
        is_whole = len(named.joints) == len(positions)
        if not is_whole:
            self._log_ignored_names(topic, None if hand is None else self._hands[hand], named.names)
        if len(named.joints):
            targets = positions if is_whole else positions[named.places]
            commander.follow(topic, named.joints, targets, guarded=True)
            commander.confirm(topic, node, stamp)
        else:
            commander.ignored += 1

    target_joints = _follow
    target_right_hand = partialmethod(_follow, hand=RIGHT)
    target_left_hand = partialmethod(_follow, hand=LEFT)

    def _log_ignored_names(self, topic: str, allowed: frozenset[str] | None, names: Sequence[str]) -> None:
        """Log ignored names, each once."""
        commander = self._commander
        reasons: dict[str, str] = {}
        for name in names:
            if name in commander.mimics.leaders:
                leader = commander.mimics.leaders[name]
                line = f"{topic}: {name} mimics {leader}; its own target is ignored (logged once)"
                commander.notices.log_once(f"follows {name}", line)
            elif name in commander.numbers:
                if allowed is not None and name not in allowed:
                    reasons[name] = "is not a joint of that hand"
            elif name in self._config.robot.joint_indices:
                kind = self._config.robot.joint(name).type.value
                reasons[name] = f"is a {kind} joint, which has no single position"
            else:
                reasons[name] = "is not a joint of this robot"
        commander.notices.log_unknown(topic, reasons)

    def target_grippers(self, row: Endpoint, message: Any, node: str) -> None:
        """Move the grippers to the requested statuses."""
        topic, commander, stamp = row.name, self._commander, nanoseconds(message.header.stamp)
        values = gripper_statuses(message, len(self._grippers))
        joints = np.concatenate([gripper.joints for gripper in self._grippers])
        positions = np.concatenate(
            [gripper.positions(status) for gripper, status in zip(self._grippers, values, strict=True)]
        )
        if len(message.position) > len(values):
            line = f"{topic}: {len(message.position)} numbers for {len(values)} grippers; those at the end are ignored"
            commander.notices.log_once(topic, f"{line} (logged once)")
        if commander.admit(topic, node, stamp):
            if not all(0.0 <= status <= 1.0 for status in values):
                shown = ", ".join(f"{status:.4g}" for status in values)
                commander.notices.log_throttled(topic, f"{topic}: clipped to 0 to 1 (got {shown})")
            commander.follow(topic, joints, positions)
            commander.confirm(topic, node, stamp)

    def stop(self, _row: Endpoint, message: Any, node: str) -> None:
        """Stop on true; false comes from a button that is not pressed, and clears nothing."""
        if message.data:
            self._commander.stop(f"emergency stop by {node or 'a client'}")

    def clear_stop(self, _row: Endpoint, _request: TriggerRequest, node: str) -> TriggerResponse:
        """End an emergency stop."""
        commander = self._commander
        if not commander.is_stopped:
            return TriggerResponse(success=True, message="there was no emergency stop")
        commander.clear_stop()
        commander.notices.log(f"emergency stop cleared by {node or 'a client'}")
        return TriggerResponse(success=True, message="the robot holds until the next command")

    def set_enabled(self, _row: Endpoint, request: SetBoolRequest, node: str) -> SetBoolResponse:
        """Take commands, or none."""
        commander = self._commander
        if request.data and commander.is_stopped:
            return SetBoolResponse(success=False, message=commander.why_ignored)
        if commander.is_enabled != request.data:
            commander.set_enabled(request.data)
            commander.notices.log(f"commands {'enabled' if request.data else 'disabled'} by {node or 'a client'}")
        return SetBoolResponse(success=True, message="commands enabled" if request.data else "commands disabled")


class BaseCommands:
    """Handler of the topic that moves the base of a robot."""

    def __init__(self, commander: Commander, base: Base) -> None:
        self._commander, self._base = commander, base

    def move_base(self, row: Endpoint, message: Any, node: str) -> None:
        """Turn and move the base."""
        if len(message.data) == 3 and self._base.mode is BaseMode.ORIGINAL:
            line = f"{row.name}: 3 numbers are taken as turn [rad] and motion along x and y [m]"
            remedy = f"for speeds set {MODE}: velocity in the robot configuration (logged once)"
            self._commander.notices.log_once(row.name, f"{line}; {remedy}")
        if self._commander.admit(row.name, node, 0):
            self._base.command(message.data.tolist())
            self._commander.confirm(row.name, node, 0)
