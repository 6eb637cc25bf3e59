"""Setpoints of servos that follow a trajectory, evaluated for many ticks at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellwright.engine.simulation import Simulation
from cellwright.mechanism.joint_trajectory import Trajectory

MAX_SETPOINT: Final = 1e6
"""Limit of setpoints [rad, m; per s], far beyond the saturation of every servo.

The engine takes much larger setpoints as a sign of divergence and zeroes all of them.
"""

MAX_BATCH: Final = 256
"""Maximum number of ticks that are evaluated at once."""

_FIRST_BATCH = 32  # a whole control period of a program; fewer ticks would cost nearly as much
_BYTES = 8  # of a number


class Setpoints:
    """Setpoints of position servos with a velocity input, for the ticks to come.

    A servo gets the desired position at the start of a step and the desired velocity at its end. Both at the end would
    cost one step of lag. The setpoints are limited to +-`MAX_SETPOINT`; NaN becomes a number.

    This is a cache: it holds what the trajectory says, and checks tick and trajectory each time. Batches begin small,
    so that a stream of commands pays for few setpoints that no tick uses.

    Args:
        simulation: the simulation of the servos.
        actuators: names of the servos, in the order of the trajectory. Their inputs are adjacent in the engine.
        origin: positions at which the servos' inputs are 0 [rad or m]; None: 0.
    """

    def __init__(self, simulation: Simulation, actuators: Sequence[str], origin: Sequence[float] | None = None) -> None:
        model = simulation.model
        addresses = [int(model.actuator_ctrladr[model.actuator(name).id]) for name in actuators]
        first, count = addresses[0], 2 * len(actuators)
        assert addresses == list(range(first, first + count, 2))
        self._simulation, self._clock = simulation, simulation.clock
        self._addresses = slice(first, first + count)
        self._find_inputs()
        simulation.on_model.append(self._find_inputs)
        self._origin = None if origin is None else np.array(origin)
        self._size = count * _BYTES
        self._trajectory: Trajectory | None = None
        self._departure = 0
        self._begin = self._count = 0  # of the batch [ticks]
        self._batch = b""

    def write(self, trajectory: Trajectory, departure: int = 0) -> None:
        """Write the setpoints of the step that begins now.

        Args:
            trajectory: the trajectory to follow.
            departure: time at which the trajectory's time is 0 [ns].
        """
        index = self._clock.tick - self._begin
        if trajectory is not self._trajectory or departure != self._departure:
            self._trajectory, self._departure = trajectory, departure
            self._evaluate(_FIRST_BATCH)
            index = 0
        elif not 0 <= index < self._count:
            self._evaluate(MAX_BATCH if index == self._count else _FIRST_BATCH)
            index = 0
        place = index * self._size
        self._inputs[:] = self._batch[place : place + self._size]

    def hold(self, positions: Sequence[float]) -> None:
        """Write setpoints of rest at some positions [rad or m]."""
        inputs = np.zeros((len(positions), 2))
        inputs[:, 0] = positions if self._origin is None else np.subtract(positions, self._origin)
        self._inputs[:] = inputs.tobytes()

    def _find_inputs(self) -> None:
        self._inputs = memoryview(self._simulation.data.ctrl[self._addresses]).cast("B")  # the fastest way to write

    def _evaluate(self, count: int) -> None:
        """Evaluate the setpoints of the next `count` ticks."""
        assert self._trajectory is not None
        tick = self._clock.tick
        times = self._clock.times(tick, count + 1, -self._departure)
        positions, velocities = self._trajectory.sample(times)
        if self._origin is not None:
            positions -= self._origin
        inputs = np.empty((count, positions.shape[1], 2))
        inputs[:, :, 0], inputs[:, :, 1] = positions[:-1], velocities[1:]
        # not `clip`, which keeps NaN
        np.fmax(inputs, -MAX_SETPOINT, out=inputs)
        self._batch = np.fmin(inputs, MAX_SETPOINT, out=inputs).tobytes()
        self._begin, self._count = tick, count
