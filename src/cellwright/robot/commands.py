"""Command topics and services of the robot's node: messages checked and made into targets."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.middleware.messages.std_srvs import SetBoolRequest, SetBoolResponse, TriggerRequest, TriggerResponse
from cellwright.robot.base import Base
from cellwright.robot.commander import Commander, Homing
from cellwright.robot.grippers import LEFT, RIGHT, GripperRange, hand_joints
from cellwright.util.errors import RejectedCommandError

MAX_ENTRIES = 4096
"""Longer messages are refused: no robot has so many joints."""


def joint_targets(message: Any) -> dict[str, float]:
    """Positions [rad; m] by joint name.

    Raises:
        RejectedCommandError: the message makes no sense; the text says why.
    """
    names: list[str] = message.name
    count = len(message.position)
    if len(names) > MAX_ENTRIES or count > MAX_ENTRIES:
        raise RejectedCommandError(f"{max(len(names), count)} entries are too many: {MAX_ENTRIES} are the most")
    if len(names) != count:
        raise RejectedCommandError(
            f"{len(names)} names and {count} positions: as many are needed of the one as of the other"
        )
    found = dict(zip(names, message.position.tolist(), strict=True))
    if len(found) != count:
        counts = Counter(names)  # in one walk: the message is a stranger's, and physics waits
        twice = next(name for name in names if counts[name] > 1)
        raise RejectedCommandError(f"{twice!r:.80} is named twice: which of the two is meant")
    for name, position in found.items():
        if not math.isfinite(position):
            raise RejectedCommandError(f"the position of {name!r:.80} is {position}")
    return found


def gripper_statuses(message: Any, count: int) -> list[float]:
    """How far each of `count` grippers is to be closed; names count for nothing, and what is too much is cut off.

    Raises:
        RejectedCommandError: there are fewer numbers than grippers, or some are not finite.
    """
    given = len(message.position)
    if given > MAX_ENTRIES:
        raise RejectedCommandError(f"{given} entries are too many: {MAX_ENTRIES} are the most")
    if given < count:
        raise RejectedCommandError(f"{given} of {count} grippers: a number is needed for each, right, left")
    values: list[float] = message.position.tolist()
    if not all(map(math.isfinite, values)):
        raise RejectedCommandError(f"a gripper's status is from 0 to 1, not {values[:8]}")
    return values[:count]


Handler = Callable[[Any, str], Any]


class Commands:
    """Hears the topics of commands, and answers the services.

    Args:
        config: the robot.
        commander: who follows them.
        homing: brings the robot home.
        grippers: right, left.
        base: what carries the robot.
    """

    def __init__(
        self, config: RobotConfig, commander: Commander, homing: Homing, grippers: Sequence[GripperRange], base: Base
    ) -> None:
        self._config, self._commander, self._homing = config, commander, homing
        self._grippers, self._base = tuple(grippers), base

    def serve(self, bus: Bus, table: tuple[Row, ...]) -> None:
        """Take a place on the bus."""
        prefix = "/io_teleop/"
        topics: dict[str, Handler] = {
            "joint_cmd": self._joints("joint_cmd"),
            "target_joint_from_vr": self._joints("target_joint_from_vr"),
            "target_finger_joints": self._joints("target_finger_joints"),
            "joint_cmd_finger_right": self._joints("joint_cmd_finger_right", RIGHT),
            "joint_cmd_finger_left": self._joints("joint_cmd_finger_left", LEFT),
            "target_gripper_status": self._gripper_status,
            "target_base_move": self._base_move,
            "emergency_stop": self._emergency_stop,
        }
        services: dict[str, Handler] = {
            "/io_teleop_reset_robot": self._homing.serve,
            "/io_teleop/set_enabled": self._set_enabled,
            "/io_teleop/clear_emergency_stop": self._clear_emergency_stop,
        }
        for row in table:
            if row.name in services:
                bus.serve(row.name, row.type, services[row.name], node=row.node)
            elif (handler := topics.get(row.name.removeprefix(prefix))) is not None:
                bus.listen(row.name, row.type, handler, node=row.node)

    # ---------------------------------------------------------------- joints

    def _joints(self, name: str, side: int | None = None) -> Handler:
        """The handler of a topic of joint targets; with a side, of that hand's."""
        allowed = None if side is None else hand_joints(self._config, side)
        return partial(self._joint_targets, f"/io_teleop/{name}", allowed)

    def _joint_targets(self, topic: str, allowed: frozenset[str] | None, message: Any, node: str) -> None:
        asked = joint_targets(message)
        numbers, commander = self._commander.numbers, self._commander

        def act() -> bool:
            known = {
                numbers[name]: position
                for name, position in asked.items()
                if name in numbers and name not in commander.mimics.leaders and (allowed is None or name in allowed)
            }
            if len(known) < len(asked):
                self._tell_of_others(topic, allowed, asked)
            if known:
                commander.follow(topic, known.keys(), known.values(), guarded=True)
            return bool(known)

        commander.take(topic, node, nanoseconds(message.header.stamp), act)

    def _tell_of_others(self, topic: str, allowed: frozenset[str] | None, asked: dict[str, float]) -> None:
        """Tell of names that are passed over, each once."""
        commander = self._commander
        strange: dict[str, str] = {}
        for name in asked:
            if name in commander.mimics.leaders:
                leader = commander.mimics.leaders[name]
                line = f"{topic}: {name} follows {leader}; its own target is passed over (told once)"
                commander.notices.tell_once(f"follows {name}", line)
            elif name in commander.numbers:
                if allowed is not None and name not in allowed:
                    strange[name] = "is no joint of that hand"
            elif name in self._config.robot.joint_indices:
                kind = self._config.robot.joint(name).type.value
                strange[name] = f"is a {kind} joint, which takes no position"
            else:
                strange[name] = "is no joint of this robot"
        commander.notices.tell_of_unknown(topic, strange)

    # ---------------------------------------------------------------- grippers and base

    def _gripper_status(self, message: Any, node: str) -> None:
        topic = "/io_teleop/target_gripper_status"
        wanted = gripper_statuses(message, len(self._grippers))
        joints = np.concatenate([gripper.joints for gripper in self._grippers])
        positions = np.concatenate(
            [gripper.positions(status) for gripper, status in zip(self._grippers, wanted, strict=True)]
        )
        if len(message.position) > len(wanted):
            line = (
                f"{topic}: {len(message.position)} numbers for {len(wanted)} grippers: those at the end are passed over"
            )
            self._commander.notices.tell_once(topic, f"{line} (told once)")

        def act() -> bool:
            if not all(0.0 <= status <= 1.0 for status in wanted):
                said = ", ".join(f"{status:.4g}" for status in wanted)
                self._commander.notices.tell_now_and_then(topic, f"{topic}: kept within 0 and 1: {said} was asked for")
            self._commander.follow(topic, joints, positions)
            return True

        self._commander.take(topic, node, nanoseconds(message.header.stamp), act)

    def _base_move(self, message: Any, node: str) -> None:
        def act() -> bool:
            self._base.command(message.data.tolist())
            return True

        self._commander.take("/io_teleop/target_base_move", node, 0, act)

    # ---------------------------------------------------------------- whether commands are taken

    def _emergency_stop(self, message: Any, node: str) -> None:
        """True stops; false is what a button says that is not pressed, and clears nothing."""
        if message.data:
            self._commander.stop(f"emergency stop by {node or 'a client'}")

    def _clear_emergency_stop(self, _request: TriggerRequest, node: str) -> TriggerResponse:
        commander = self._commander
        if not commander.is_stopped:
            return TriggerResponse(success=True, message="there was no emergency stop")
        commander.clear_stop()
        commander.notices.tell(f"emergency stop cleared by {node or 'a client'}")
        return TriggerResponse(success=True, message="the robot stays where it is until the next command")

    def _set_enabled(self, request: SetBoolRequest, node: str) -> SetBoolResponse:
        commander = self._commander
        if request.data and commander.is_stopped:
            return SetBoolResponse(
                success=False, message="the emergency stop is on: /io_teleop/clear_emergency_stop ends it"
            )
        if commander.is_enabled != request.data:
            commander.set_enabled(request.data)
            commander.notices.tell(f"commands are switched {'on' if request.data else 'off'} by {node or 'a client'}")
        return SetBoolResponse(success=True, message="takes commands" if request.data else "takes no commands")
