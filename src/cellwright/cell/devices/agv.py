"""Automated guided vehicle: its path to the dock and back, and the device that drives it with a tray.

The original moves an AGV through key frames with a spline. Its tangent at a key frame is half the difference between
the next and the previous frame, per interval, regardless of the interval's duration. Its speed therefore jumps, by up
to 0.8 m/s, between intervals of different length, and at both ends. Here the tangents are velocities: the difference
between the next and the previous frame over the time between them, and zero at the ends. So velocity is continuous from
standstill to standstill, and the load on the tray can follow. The AGV reaches every key frame when the original does.
Between them the two paths differ by less than 0.08 m on the way out and 0.2 m on the way back.
"""

from fractions import Fraction
from itertools import pairwise
from typing import ClassVar, Final, Literal

from cellwright.cell.devices.kit_sender import KitSender
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.config.layout.layout import Carrier, KeyFrames
from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.joint_trajectory import Knot, Segment, Trajectory, join_segment
from cellwright.mechanism.setpoints import Setpoints

PACE: Final = Fraction(6, 5)
"""Factor by which the times of the key frames are shortened."""


def agv_path(frames: KeyFrames) -> Trajectory:
    """Return the path of a carrier's origin, x and y, from its departure.

    Before and after the path the AGV stands. Its height and heading stay constant.
    """
    times = [round(Fraction(time) / PACE * NANOSECONDS) for time, _, _ in frames]
    return Trajectory([_through(times, [x for _, x, _ in frames]), _through(times, [y for *_, y in frames])])


def _through(times: list[int], values: list[float]) -> list[Segment]:
    """Return cubics through one coordinate's values, at rest at both ends."""
    # The velocity at a frame is that of the chord between its neighbours (Catmull and Rom), so it has no jump there.
    inner = [
        (after - before) / ((late - early) / NANOSECONDS)
        for before, after, early, late in zip(values, values[2:], times, times[2:], strict=False)
    ]
    knots = [Knot(value, velocity) for value, velocity in zip(values, [0.0, *inner, 0.0], strict=True)]
    return [join_segment(s, a, e, b) for (s, e), (a, b) in zip(pairwise(times), pairwise(knots), strict=True)]


class Agv(KitSender):
    """AGV.

    A call makes it prepare. After 0.75 s the parts are locked to the tray, the kit is submitted and it departs. At the
    end of the path the kit leaves the cell, and the AGV returns.
    """

    STATE: ClassVar[tuple[str, ...]] = (*KitSender.STATE, "_departed")

    def __init__(self, carrier: Carrier, tray: KitTray) -> None:
        super().__init__(carrier.name, tray)
        self._paths = {"delivering": agv_path(carrier.out), "returning": agv_path(carrier.back)}
        self._station = self._paths["delivering"].positions(0)
        self._departed = 0

    def attach(self, simulation: Simulation) -> None:
        """Look up the servos of its two slides."""
        super().attach(simulation)
        self._setpoints = Setpoints(simulation, [f"{self.name}_{axis}" for axis in "xy"], self._station)

    def reset(self) -> None:
        """Stand at the station, ready."""
        super().reset()
        self._departed = 0
        self._setpoints.hold(self._station)
        self.set_stepping(False)

    def handle_depart(self) -> None:
        """Depart with the tray, and submit its kit."""
        self.tray.lock()
        self._set_off("delivering")
        self.submit()

    def handle_arrive(self) -> None:
        """Deliver the kit, or become ready again."""
        if self.state == "delivering":
            self.state = "delivered"
            self.tray.clear()
            self.simulation.schedule(self, "turn", at=self.simulation.now + 1)
        else:
            self.state = "ready_to_deliver"
            self.set_stepping(False)
            self._setpoints.hold(self._station)

    def handle_turn(self) -> None:
        """Depart for the station."""
        self._set_off("returning")

    def before_step(self) -> None:
        """Drive along the path."""
        path = self._paths.get(self.state)
        if path is not None:
            self._setpoints.write(path, self._departed)

    def _set_off(self, state: Literal["delivering", "returning"]) -> None:
        self.state = state
        self._departed = self.simulation.now
        self.simulation.schedule(self, "arrive", at=self._departed + self._paths[state].end)
        self.set_stepping(True)
        self.simulation.wake(self.simulation.model.body(self.name).id)
