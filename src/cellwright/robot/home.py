"""Going home: the service of the node's original, which there answers after a second whatever has become of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.clock import nanoseconds
from cellwright.engine.device import Device, State
from cellwright.middleware.bus import Later
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.robot.commander import Commander

TIME = 5.0
"""So long [s] the way home may take."""
NEAR = 1e-3
"""So near [rad; m] to its place a joint is at home."""
STILL = 1e-2
"""So slow [rad/s; m/s] it has to be there."""
MOST_WAITING = 1000
"""More callers than these are not kept waiting at a time; they come from outside, and must not eat the memory."""
DONE = "Service successfully triggered!"
"""What the original answers."""


class Homing(Device):
    """Brings the robot home, and says so once it is there.

    Arms, waist, head and lift go to their home postures where the configuration has such, grippers open. All other
    joints go where they were last told to.

    Args:
        config: the robot.
        commander: who sends the joints there.
    """

    def __init__(self, config: RobotConfig, commander: Commander) -> None:
        super().__init__("homing")
        self._commander = commander
        home = {
            name: position
            for name, position in config.home.items()
            if name in commander.numbers and math.isfinite(position)
        }
        self._joints = np.array([commander.numbers[name] for name in home], dtype=np.intp)
        self._positions = np.clip(
            np.array(list(home.values())), commander.lower[self._joints], commander.upper[self._joints]
        )
        self._until: int | None = None
        self._waiting: list[Later] = []

    def reset(self) -> None:
        """Nobody is on the way."""
        self._until = None
        self._answer("the node has begun anew")
        self.set_stepping(False)

    def serve(self, _request: TriggerRequest, node: str) -> Any:
        """Answer a call: at once if the robot may not move, else when it is home. Two calls are one way home."""
        commander = self._commander
        if commander.is_stopped:
            return _failed("the emergency stop is on: /io_teleop/clear_emergency_stop ends it")
        if not commander.is_enabled:
            return _failed("commands are switched off: /io_teleop/set_enabled switches them on")
        if not commander.is_homing:
            self._end_if_held()
            commander.begin_homing(self._joints, self._positions)
            self._until = self.simulation.now + nanoseconds(TIME)
            self.set_stepping(True)
            commander.notices.tell(f"going home, as {node or 'a client'} asked for")
        if len(self._waiting) >= MOST_WAITING:
            return _failed(f"the robot goes home, and {MOST_WAITING} calls wait for it already")
        later = Later()
        self._waiting.append(later)
        return later

    def after_step(self) -> None:
        """See whether the robot is there, or will not be."""
        commander, until = self._commander, self._until
        if until is None or not commander.is_homing:
            self._end_if_held()
            return
        readings = commander.driver.read()
        error = np.abs(readings.positions[self._joints] - self._positions)
        is_late = self.simulation.now >= until
        if (error <= NEAR).all() and (np.abs(readings.velocities[self._joints]) <= STILL).all():
            commander.end_homing()
            self._end("")
        elif is_late:
            worst = int(np.argmax(error))
            name = commander.driver.joints[self._joints[worst]]
            why = f"not at home after {TIME:g} s: {name} is {error[worst]:.3g} away"
            commander.hold(why)
            self._end(f"{why}; the robot is held where it stands")

    def get_state(self) -> State:
        """Until when the robot is to be home. Who waits for it is not kept."""
        return {"until": self._until}

    def set_state(self, state: State) -> None:
        """Take over what `get_state` returned."""
        self._until = state["until"]

    def close(self) -> None:
        """Tell those who wait that nothing will come of it."""
        self._answer("the node has stopped")

    def _end_if_held(self) -> None:
        """End a way home that something else has ended already."""
        if self._until is not None:
            self._end(f"the robot was held on its way: {self._commander.why_held}")

    def _end(self, why_not: str) -> None:
        self._until = None
        self.set_stepping(False)
        if why_not:
            self._commander.notices.tell(f"reset: {why_not}")
        self._answer(why_not)

    def _answer(self, why_not: str) -> None:
        waiting, self._waiting = self._waiting, []
        for later in waiting:
            later.answer(_failed(why_not) if why_not else TriggerResponse(success=True, message=DONE))


def _failed(why: str) -> TriggerResponse:
    return TriggerResponse(success=False, message=why)
