"""The vacuum gripper: a cup that takes hold of what it touches squarely, by a weld in the engine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.devices.gripper.vacuum_check import CupContact, Touched, VacuumCheck
from cellwright.cell.devices.gripper.weld import engage
from cellwright.cell.devices.parts import Parts
from cellwright.cell.model.arm import CUP_FACE_GEOM, CUP_GEOM, GRIPPER
from cellwright.cell.model.build import WorldPart
from cellwright.engine.device import Device, State
from cellwright.engine.events import NEVER
from cellwright.engine.simulation import Simulation
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

BELT_GEOM = "conveyor_belt"

_NEAR = 1e-3
"""What is nearer to the cup than this [m] is in contact with it: the distance from which the engine tells of it."""

_REACH = 0.4
"""No part is larger [m]: an origin further from the cup than this cannot be near it."""


class VacuumGripper(Device):
    """The gripper.

    `reason` says why nothing is held, `lost_reason` why the last part was lost. Whoever is in `on_change` is told when
    it is switched, takes hold or lets go. `drop_target(name, world_T_part)`, if it is set, is asked at each look
    whether a held part is to be lost, and where to.

    Args:
        parts: what can be taken hold of.
        phase: when in each 0.1 s it looks for them [ns]; None: as soon as it is switched on.
    """

    def __init__(self, parts: Parts, phase: int | None = None) -> None:
        super().__init__("gripper")
        self.parts = parts
        self.on_change: list[Callable[[VacuumGripper], None]] = []
        self.drop_target: Callable[[str, Pose], Pose | None] = lambda _name, _pose: None
        self._check = VacuumCheck(phase)
        parts.on_taken.append(self._notice_taken)

    def attach(self, simulation: Simulation) -> None:
        """Look up the cup and what moves."""
        super().attach(simulation)
        model = simulation.model
        self._body = model.body(GRIPPER).id
        self._cup = model.geom(CUP_GEOM).id
        self._face = model.geom(CUP_FACE_GEOM).id
        self._belt = model.geom(BELT_GEOM).id

    def reset(self) -> None:
        """Switched off, holding nothing."""
        self._check.reset()

    # ---------------------------------------------------------------- what one may ask

    @property
    def enabled(self) -> bool:
        """Whether the vacuum is on."""
        return self._check.enabled

    @property
    def attached(self) -> bool:
        """Whether a part is held."""
        return self._check.attached

    @property
    def part(self) -> str | None:
        """Full model name of the part that is held."""
        return self._check.part

    @property
    def reason(self) -> str:
        """Why nothing is held, as of the last look; empty while a part is held."""
        return self._check.reason

    @property
    def lost_reason(self) -> str:
        """Why the last part was lost; empty if none was yet."""
        return self._check.lost_reason

    # ---------------------------------------------------------------- commands

    def set_enabled(self, enabled: bool) -> None:  # noqa: FBT001
        """Switch the vacuum on or off. Switched off it lets go at once."""
        if enabled == self.enabled:
            return
        if enabled:
            self._check.enable(self.simulation.now)
        else:
            self._release(self._check.disable())
        self._plan()
        self._tell()

    # ---------------------------------------------------------------- life

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Look at the contacts."""
        if kind != "look":
            super().handle(kind, arguments)
        targets: dict[str, Pose] = {}

        def is_dropped(name: str) -> bool:
            target = self.drop_target(name, self.parts.pose(self.parts.part(name)))
            if target is not None:
                targets[name] = target
            return target is not None

        verdict = self._check.check(self.simulation.now, self.contacts(), is_dropped)
        if verdict.action == "attach" and verdict.part is not None:
            self._hold(self.parts.part(verdict.part))
        elif verdict.action == "drop" and verdict.part is not None:
            self._release(verdict.part)
            self.parts.place(self.parts.part(verdict.part), targets[verdict.part])
        self._plan()
        if verdict.action != "none":
            self._tell()

    def get_state(self) -> dict[str, Any]:
        """What the suction logic remembers."""
        return self._check.get_state()

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned."""
        self._check.set_state(state)

    # ---------------------------------------------------------------- inside

    def contacts(self) -> list[CupContact]:
        """What the cup touches: by the engine's contacts in the last step, and by the plain disc that it stands for.

        The cup's edge is bevelled where the original's gripper is a plain disc. A part that meets the bevel only, as
        the mark of a disk does, would else seem to be tilted by the bevel's angle, or not to be touched yet.
        """
        data = self.simulation.data
        pairs = data.contact.geom
        axis = np.array(data.xmat[self._body].reshape(3, 3)[:, 2])
        found = []
        for row in np.flatnonzero((pairs == self._cup).any(axis=1)).tolist():
            first, second = pairs[row].tolist()
            towards_cup = 1.0 if second == self._cup else -1.0
            alignment = towards_cup * float(data.contact.frame[row][:3] @ axis)
            found.append(self._contact(first if second == self._cup else second, alignment))
        return found + self._before_face()

    def _before_face(self) -> list[CupContact]:
        """The parts that the plain disc touches."""
        simulation = self.simulation
        simulation.refresh()
        model, data = simulation.model, simulation.data
        axis = data.xmat[self._body].reshape(3, 3)[:, 2]
        centre = data.xpos[self._body]
        ends: NDArray[np.float64] = np.zeros(6)
        found = []
        for part in self.parts.inside(centre - _REACH, centre + _REACH):
            for geom in part.geoms:
                distance = mujoco.mj_geomDistance(model, data, self._face, geom, _NEAR, ends)
                if distance < _NEAR and distance != 0.0:
                    normal = (ends[:3] - ends[3:]) / distance  # from the part to the disc, also where they overlap
                    found.append(self._touched(part, float(normal @ axis)))
        return found

    def _contact(self, geom: int, alignment: float) -> CupContact:
        model = self.simulation.model
        body = int(model.geom_bodyid[geom])
        part = self.parts.by_body.get(body)
        if part is not None:
            return self._touched(part, alignment)
        name = model.geom(geom).name or model.body(body).name
        moves = geom == self._belt or int(model.body_treeid[body]) >= 0
        return CupContact(name, Touched.MOVABLE if moves else Touched.FIXED, alignment)

    def _touched(self, part: WorldPart, alignment: float) -> CupContact:
        """Contact with a part; one that is locked to a tray stays there."""
        return CupContact(part.name, Touched.FIXED if self.parts.is_locked(part) else Touched.PART, alignment)

    def _hold(self, part: WorldPart) -> None:
        """Weld the part to the cup as it is now: no drawing in, no re-centring."""
        if part.grip is None:
            raise UsageError(f"the cell has no weld to hold {part.name!r} with")
        simulation = self.simulation
        simulation.refresh()
        data = simulation.data
        position, quaternion = data.xpos[self._body].tolist(), data.xquat[self._body].tolist()
        gripper_T_world = Pose(tuple(position), tuple(quaternion)).inverse()
        engage(simulation, part.grip, self._body, gripper_T_world @ self.parts.pose(part))

    def _release(self, name: str | None) -> None:
        if name is not None:
            part = self.parts.part(name)
            if part.grip is not None:
                self.simulation.data.eq_active[part.grip] = 0
            self.simulation.keep_awake(part.body)

    def _notice_taken(self, part: WorldPart) -> None:
        """Note that a part is in the cup no longer, if it was."""
        if part.name == self._check.part:
            self._check.lose("taken away")
            self._tell()

    def _plan(self) -> None:
        self.simulation.cancel(self, "look")
        if self._check.next_look < NEVER:
            self.simulation.schedule(self, "look", at=self._check.next_look)

    def _tell(self) -> None:
        for listener in self.on_change:
            listener(self)
