"""Base of a robot that is not fixed to the world: commands move it at once, as in the original."""

import math
from collections.abc import Sequence

import numpy as np

from cellwright.config.robot.config import BaseMode, RobotConfig
from cellwright.engine.clock import nanoseconds
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.robot.model import BASE_BODY
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose

MAX_STEP = 10.0
"""Maximum motion of the base by one message [m; rad]; also its maximum speed [m/s; rad/s]."""
MAX_DISTANCE = 1000.0
"""Maximum distance from the world's origin [m]."""
TIMEOUT = 0.2
"""Time [s] for which a speed holds without a new one."""
MODE = "base_command_mode"
"""Key of a robot configuration for the meaning of base commands."""

_MEANING = {
    BaseMode.ORIGINAL: "turn [rad], move along y [m]",
    BaseMode.DELTA: "turn [rad], move along x and y [m]",
    BaseMode.VELOCITY: "turn [rad/s], move along x and y [m/s]",
}


class Base(Device):
    """Base of a robot.

    Two numbers are the original's command, three that of adopters: turn, forward, sideways. The configuration key
    `base_command_mode` says whether the three are distances or speeds; then all commands have three.
    """

    def __init__(self, config: RobotConfig) -> None:
        super().__init__("base")
        self._first = config.base_pose
        given = config.others.get(MODE)
        self.mode = BaseMode(given) if given in (BaseMode.DELTA, BaseMode.VELOCITY) else BaseMode.ORIGINAL
        self.pose = config.base_pose
        """World_T_base."""
        self._velocity = (0.0, 0.0, 0.0)
        self._until = 0

    def attach(self, simulation: Simulation) -> None:
        """Look up the body that carries the robot."""
        super().attach(simulation)
        self._mocap = int(simulation.model.body(BASE_BODY).mocapid[0])

    def reset(self) -> None:
        """Return to the configured pose."""
        self.halt()
        self.place(self._first)

    def command(self, data: Sequence[float]) -> None:
        """Execute a command: two or three numbers, with meaning and units by `mode`.

        Without a mode three numbers are distances, as two are.

        Raises:
            RejectedCommandError: the numbers are invalid; nothing was changed.
        """
        mode = self.mode
        if mode is BaseMode.ORIGINAL and len(data) == 3:
            mode = BaseMode.DELTA
        count = 2 if mode is BaseMode.ORIGINAL else 3
        if len(data) != count:
            also = f"; or 3: {_MEANING[BaseMode.DELTA]}" if mode is BaseMode.ORIGINAL else ""
            raise RejectedCommandError(f"data must have {count} numbers (got {len(data)}): {_MEANING[mode]}{also}")
        if not all(map(math.isfinite, data)):
            raise RejectedCommandError(f"data must be finite (got {list(data)})")
        if any(abs(value) > MAX_STEP for value in data):
            raise RejectedCommandError(f"data must be between -{MAX_STEP:g} and {MAX_STEP:g} (got {list(data)})")
        if mode is BaseMode.VELOCITY:
            self._velocity = (data[0], data[1], data[2])
            self._until = self.simulation.now + nanoseconds(TIMEOUT)
            self.set_stepping(True)
        elif mode is BaseMode.DELTA:
            self._move(data[0], data[1], data[2])
        else:
            self._move(data[0], 0.0, data[1])

    def halt(self) -> None:
        """Stop."""
        self._velocity, self._until = (0.0, 0.0, 0.0), 0
        self.set_stepping(False)

    def before_step(self) -> None:
        """Move on, in velocity mode."""
        if self.simulation.now >= self._until:
            self.halt()
            return
        seconds = float(self.simulation.clock.timestep)
        try:
            self._move(*(speed * seconds for speed in self._velocity))
        except RejectedCommandError:
            self.halt()

    def get_state(self) -> State:
        """Return pose and velocity."""
        return {
            "position": list(self.pose.position),
            "quaternion": list(self.pose.quaternion),
            "velocity": list(self._velocity),
            "until": self._until,
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        x, y, z = state["position"]
        self.place(Pose((x, y, z), tuple(state["quaternion"])))
        turn, forward, left = state["velocity"]
        self._velocity, self._until = (turn, forward, left), state["until"]

    def _move(self, turn: float, x: float, y: float) -> None:
        moved = self.pose @ Pose.from_rpy((x, y, 0.0), (0.0, 0.0, turn))
        if any(abs(value) > MAX_DISTANCE for value in moved.position):
            raise RejectedCommandError(f"the base must stay within {MAX_DISTANCE:g} m of the origin")
        # Without this it would grow with every message.
        length = math.hypot(*moved.quaternion)
        w, i, j, k = (value / length for value in moved.quaternion)
        self.place(Pose(moved.position, (w, i, j, k)))

    def place(self, pose: Pose) -> None:
        """Place the carrying body at once: `pose` is world_T_base."""
        self.pose = pose
        data = self.simulation.data
        data.mocap_pos[self._mocap] = np.array(pose.position)
        data.mocap_quat[self._mocap] = np.array(pose.quaternion)
        self.simulation.touch()
