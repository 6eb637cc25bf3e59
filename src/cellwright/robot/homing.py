"""Homing of a robot: the motion to its home posture, and the responses to its callers."""

import math
from typing import Any

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.clock import nanoseconds
from cellwright.engine.device import Device
from cellwright.middleware.bus import PendingResponse
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.robot.commander import Commander

HOMING_TIMEOUT = 5.0
"""Maximum duration of homing [s]."""
HOME_TOLERANCE = 1e-3
"""Position tolerance of a joint at home [rad; m]."""
HOME_SPEED_TOLERANCE = 1e-2
"""Maximum speed of a joint at home [rad/s; m/s]."""
MAX_WAITING_CALLS = 1000
"""Maximum number of waiting callers; the limit protects memory from clients."""
HOMING_RESPONSE = "Service successfully triggered!"
"""Response of the original."""


class Homing(Device):
    """Homing: moves the robot home, and responds to the callers at the end.

    Arms, waist, head and lift go to their configured home postures, and grippers open. All other joints go to their
    newest targets.
    """

    STATE = ("_until",)  # waiting callers are not saved

    def __init__(self, config: RobotConfig, commander: Commander) -> None:
        super().__init__("homing")
        self._commander = commander
        numbers, limiter = commander.numbers, commander.limiter
        home = {
            numbers[name]: position
            for name, position in config.home.items()
            if name in numbers and math.isfinite(position)
        }
        self._joints = np.array(list(home), dtype=np.intp)
        self._positions = np.clip(
            np.array(list(home.values())), limiter.lower[self._joints], limiter.upper[self._joints]
        )
        self._until: int | None = None
        self._waiting: list[PendingResponse] = []

    def reset(self) -> None:
        """Clear the waiting callers and the running motion."""
        self._until = None
        self._respond("the node was reset")
        self.set_stepping(False)

    def go_home(self, _row: Endpoint, _request: TriggerRequest, node: str) -> Any:
        """Handle a call: fail at once if the robot may not move, else respond at home. Two calls share one motion."""
        commander = self._commander
        if not commander.is_homing:
            if commander.why_ignored:
                return _failure(commander.why_ignored)
            self._end_if_held()
            commander.begin_homing(self._joints, self._positions)
            self._until = self.simulation.now + nanoseconds(HOMING_TIMEOUT)
            self.set_stepping(True)
            commander.notices.log(f"reset by {node or 'a client'}: the robot goes home")
        if len(self._waiting) >= MAX_WAITING_CALLS:
            return _failure(
                f"too many calls wait for the reset (at most {MAX_WAITING_CALLS}); call again when the robot is home"
            )
        pending = PendingResponse()
        self._waiting.append(pending)
        return pending

    def after_step(self) -> None:
        """Check whether the robot is home, or has failed."""
        commander, until = self._commander, self._until
        if until is None or not commander.is_homing:
            self._end_if_held()
            return
        readings = commander.driver.read()
        error, speed = np.abs(readings.positions[self._joints] - self._positions), readings.velocities[self._joints]
        if (error <= HOME_TOLERANCE).all() and (np.abs(speed) <= HOME_SPEED_TOLERANCE).all():
            commander.end_homing()
            self._end("")
        elif self.simulation.now >= until:
            worst = int(np.argmax(error))
            name = commander.driver.joints[self._joints[worst]]
            why = f"not at home after {HOMING_TIMEOUT:g} s: {name} is {error[worst]:.3g} away"
            commander.hold(why)
            self._end(f"{why}; the robot holds its position")

    def close(self) -> None:
        """Respond to waiting callers that homing has failed."""
        self._respond("the node has stopped")

    def _end_if_held(self) -> None:
        """End homing after a hold."""
        if self._until is not None:
            self._end(f"the reset was interrupted: {self._commander.why_held}")

    def _end(self, failure: str) -> None:
        self._until = None
        self.set_stepping(False)
        if failure:
            self._commander.notices.log(f"reset: {failure}")
        self._respond(failure)

    def _respond(self, failure: str) -> None:
        waiting, self._waiting = self._waiting, []
        for pending in waiting:
            pending.answer(_failure(failure) if failure else TriggerResponse(success=True, message=HOMING_RESPONSE))


def _failure(why: str) -> TriggerResponse:
    return TriggerResponse(success=False, message=why)
