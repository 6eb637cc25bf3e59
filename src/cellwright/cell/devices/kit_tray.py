"""Kit trays, which report the parts on their plates once a second, and the demonstration tray."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Self

from cellwright.cell.devices.parts import Parts
from cellwright.cell.kitting.effects import CompetitionState, Effect, StateChanged
from cellwright.cell.kitting.fates import Removal
from cellwright.cell.model.build import WorldPart, demo_origin
from cellwright.cell.model.tray import plate_name
from cellwright.config.layout.layout import Station
from cellwright.config.trial.trial import KitObject, Trial
from cellwright.engine.clock import nanoseconds
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.welds import engage_weld
from cellwright.util.pose import Pose, Vector3

REPORT_PERIOD = Fraction(1)
"""Time between two reports [s] (ARIAC 2017: the tray's contact sensor runs at 1 Hz)."""

CONTACT_DISTANCE = 5e-4
"""Maximum distance [m] of a part that stands on the plate. It replaces contacts, which a sleeping part lacks."""

_ASIDE, _DOWN, _UP = 0.6, 0.1, 0.3
"""Extent of the space above a tray from its link [m], in any orientation of the tray; further for larger ones."""

DROP_HEIGHT = 0.1
"""Height over the tray link from which the parts are dropped [m] (ARIAC 2017)."""


@dataclass(frozen=True, slots=True)
class TrayPart:
    """Part on a tray; the pose is that of the part in the tray frame."""

    name: str
    pose: Pose


class KitTray(Device):
    """Tray of an AGV or a fixed one.

    `contents` is the last report: parts in contact with the base plate and those locked to the tray. A part lying on
    another part is not among them. It changes once a second and then runs the callbacks in `on_report`.
    """

    def __init__(self, station: Station, parts: Parts) -> None:
        super().__init__(station.tray_name)
        self.number = station.number
        self.parts = parts
        self.station = station
        self.link = station.tray_link
        self._extent = station.plate
        self._aside = max(_ASIDE, math.hypot(*station.plate) / 2)
        self.contents: tuple[TrayPart, ...] = ()
        self.on_report: list[Callable[[KitTray], None]] = []

    def attach(self, simulation: Simulation) -> None:
        """Look up link and plate."""
        super().attach(simulation)
        self._body = simulation.model.body(self.link).id
        self._plate = simulation.model.geom(plate_name(self.station)).id

    def reset(self) -> None:
        """Begin a run: empty, with reports each second from now on."""
        self.contents = ()
        self._schedule(1)

    def handle_report(self, number: int) -> None:
        """Take a report."""
        self._schedule(number + 1)
        self._notify()

    @property
    def world_T_tray(self) -> Pose:
        """Present pose of the tray link."""
        simulation = self.simulation
        simulation.refresh()
        return Pose(tuple(simulation.data.xpos[self._body].tolist()), tuple(simulation.data.xquat[self._body].tolist()))

    def find_parts(self) -> tuple[TrayPart, ...]:
        """Return the parts that stand on the plate or are locked to it now, in the order of the parts."""
        world_T_tray = self.world_T_tray
        tray_T_world = world_T_tray.inverse()
        x, y, z = world_T_tray.position
        aside = self._aside
        lower, upper = (x - aside, y - aside, z - _DOWN), (x + aside, y + aside, z + _UP)
        return tuple(
            TrayPart(part.name, tray_T_world @ self.parts.pose(part))
            for part in self.parts.inside(lower, upper)
            if self._is_locked(part) or self.parts.touches(part, self._plate, within=CONTACT_DISTANCE, cutoff=0.01)
        )

    def is_below(self, point: Vector3) -> bool:
        """Return whether a point of the world [m] is above the plate, within 0.3 m of it."""
        x, y, z = self.world_T_tray.inverse().transform(point)
        return abs(x) <= self._extent[0] / 2 and abs(y) <= self._extent[1] / 2 and 0.0 <= z <= _UP

    def lock(self) -> None:
        """Fix the reported parts to the tray, each where it is, so that none is lost on the way.

        A cup that holds one loses it: cup and AGV would tear it apart.
        """
        tray_T_world = self.world_T_tray.inverse()
        for part in (self.parts.part(each.name) for each in self.contents if each.name in self.parts.in_play):
            if self._is_locked(part):
                continue
            tray_T_part = tray_T_world @ self.parts.pose(part)
            self.parts.take_from_cup(part)
            engage_weld(self.simulation, part.locks[self.number], self._body, tray_T_part)

    def take_out(self) -> None:
        """Take the reported parts out of the cell, where the tray stands."""
        for name in [each.name for each in self.contents if each.name in self.parts.in_play]:
            self.parts.put_away(self.parts.part(name), Removal.DELIVERY)
        self._notify()

    def clear(self) -> None:
        """Take the locked parts out of the cell."""
        for part in self.parts.all:
            if self._is_locked(part):
                self.parts.put_away(part, Removal.DELIVERY)
        self._notify()

    def remove_all(self) -> None:
        """Take everything that stands on the tray out of the cell."""
        for each in self.find_parts():
            self.parts.put_away(self.parts.part(each.name))
        self._notify()

    def _notify(self) -> None:
        self.contents = self.find_parts()
        for listener in self.on_report:
            listener(self)

    def get_state(self) -> dict[str, Any]:
        """Return the last report."""
        return {"contents": [[each.name, *each.pose.position, *each.pose.quaternion] for each in self.contents]}

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned; locks are restored with the engine."""
        self.contents = tuple(
            TrayPart(name, Pose((x, y, z), (qw, qx, qy, qz))) for name, x, y, z, qw, qx, qy, qz in state["contents"]
        )

    def _schedule(self, report: int) -> None:
        self.simulation.schedule(self, "report", report, at=nanoseconds(report * REPORT_PERIOD))

    def _is_locked(self, part: WorldPart) -> bool:
        lock = part.locks.get(self.number)
        return lock is not None and bool(self.simulation.data.eq_active[lock])


class DemoTray(Device):
    """Demonstration tray: after `fill` it drops `parts[i]` at the ordered place and turn of `objects[i]`."""

    def __init__(self, tray: KitTray, parts: Parts, pool: Sequence[WorldPart], objects: Sequence[KitObject]) -> None:
        super().__init__("demo_tray")
        self.tray = tray
        self.parts = parts
        self._pool = tuple(pool)
        self._objects = tuple(objects)

    @classmethod
    def of(cls, trial: Trial, trays: Iterable[KitTray], parts: Parts) -> Self | None:
        """Return the demonstration tray of a trial, on its first tray; None if it fills none."""
        clones = trial.demo_clones()
        pool = [parts.part(f"{demo_origin(trial)}|{name}") for name, _ in clones]
        return cls(next(iter(trays)), parts, pool, [each for _, each in clones]) if clones else None

    def take_effect(self, effect: Effect) -> None:
        """Fill it as the competition begins."""
        if isinstance(effect, StateChanged) and effect.state is CompetitionState.GO:
            self.fill()

    def fill(self) -> None:
        """Begin with the next step."""
        self.simulation.schedule(self, "drop", 0, at=self.simulation.now + 1)

    def handle_drop(self, number: int) -> None:
        """Drop one part."""
        if number < len(self._objects):
            ordered = self._objects[number].pose
            x, y, _ = ordered.position
            tray_T_part = Pose((x, y, DROP_HEIGHT), ordered.quaternion)
            self.parts.place(self._pool[number], self.tray.world_T_tray @ tray_T_part)
            self.simulation.schedule(self, "drop", number + 1, at=self.simulation.now + 1)
