"""Vacuum gripper: suction logic, and the device that welds the part it touches squarely to the cup.

While switched on, the gripper checks its contacts at most every 0.1 s of simulation time. It checks at once when it is
switched on, if the last check is that long ago. A counter rises by one at a check with a contact that counts, and falls
by one (not below zero) at a check without. The gripper grips a part at a check if the counter is above one and the cup
stands square enough on the part. Switching does not reset the counter.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from math import acos, degrees
from typing import ClassVar, Final, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.devices.parts import MAX_PART_SIZE, Parts
from cellwright.cell.model.arm import CUP_FACE_GEOM, CUP_GEOM
from cellwright.cell.model.build import WorldPart
from cellwright.config.layout.arms import Arm
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import GRIPPER
from cellwright.engine.clock import NANOSECONDS, NEVER, nanoseconds
from cellwright.engine.device import Device, PlainState
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.welds import engage_weld
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

CHECK_PERIOD: Final = NANOSECONDS // 10
"""Time between two checks of the contacts [ns]."""

CONTACTS_NEEDED: Final = 1
"""The counter must be above this value."""

ALIGNMENT_NEEDED: Final = 0.95
"""The cosine between contact normal and cup axis must be above this value (18.2 deg)."""

_ALIGNMENT_DIGITS: Final = 6
"""Decimals of the cosine that count when two parts are compared (0.08 deg): a rounding error chooses none."""

_STEPS = 200
"""Maximum number of steps that bring a part to the cup."""

_TOUCH = 1e-4
"""Distance of cup and part that touch [m]."""

_NEAR = 1e-3
"""Maximum distance [m] of a contact with the cup; the engine reports contacts from this distance on."""


class ContactKind(Enum):
    """Kind of object in contact with the cup."""

    PART = "a part"
    MOVABLE = "a movable object that is not a part"
    """A tray, an AGV or the belt: it counts as a contact, but the suction holds parts only."""
    FIXED = "a fixed object"
    """A bin or the workcell: it does not count."""


@dataclass(frozen=True, slots=True)
class CupContact:
    """Contact of the suction face.

    `alignment` is the cosine between the contact normal and the axis of the cup, 1 when the cup stands square on it.
    """

    name: str
    kind: ContactKind
    alignment: float


class VacuumCheck(PlainState):
    """Suction logic: a device passes the contacts of the cup to `check` when a check is due.

    Args:
        phase: None checks as soon as the gripper is switched on. With a phase [ns] checks happen only at that time
            after each whole 0.1 s, as if the gripper had a clock of its own.
    """

    STATE: ClassVar = ("enabled", "part", "counter", "reason", "lost_reason", "next_look", "_last_look")

    def __init__(self, phase: int | None = None) -> None:
        self.set_phase(phase)
        self.reset()

    def set_phase(self, phase: int | None) -> None:
        """Set the phase of the checks [ns], before a run."""
        self.phase = None if phase is None else phase % CHECK_PERIOD

    def reset(self) -> None:
        """Begin a run: switched off, holding nothing."""
        self.enabled = False
        self.part: str | None = None
        """Name of the held part."""
        self.counter = 0
        self.reason = "disabled"
        """Reason why nothing is held, as of the last check; empty while a part is held."""
        self.lost_reason = ""
        """Reason for the last loss of a part: `released`, `forced drop`, or the argument of `lose`; empty before."""
        self.next_look = NEVER
        """Time of the next check [ns]; `NEVER` while switched off."""
        self._last_look: int | None = None

    @property
    def attached(self) -> bool:
        """True if a part is held."""
        return self.part is not None

    def enable(self, now: int) -> None:
        """Switch on at `now` [ns]. Has no effect if it is on."""
        if not self.enabled:
            self.enabled = True
            self.reason = "waiting for the first check"
            self.next_look = self._look_after(now)

    def disable(self) -> str | None:
        """Switch off, and return the part to release, if one was held."""
        self.enabled = False
        self.next_look = NEVER
        part = self.lose("released")
        self.reason = "disabled"
        return part

    def lose(self, reason: str) -> str | None:
        """Note the loss of the held part, if there is one, and return it."""
        part, self.part = self.part, None
        if part is not None:
            self.reason = self.lost_reason = reason
        return part

    def check(self, now: int, contacts: Sequence[CupContact], *, is_dropped: bool = False) -> None:
        """Check all contacts of the cup's suction face, not before `next_look`; `part` holds the result.

        With `is_dropped`, a held part is lost where it is now.
        """
        self._last_look = now
        self.next_look = self._look_after(now + 1)
        counted = [contact for contact in contacts if contact.kind is not ContactKind.FIXED]
        self.counter = self.counter + 1 if counted else max(0, self.counter - 1)
        if self.part is not None:
            if is_dropped:
                self.lose("forced drop")
            return
        parts = [contact for contact in counted if contact.kind is ContactKind.PART]
        square = [contact for contact in parts if contact.alignment > ALIGNMENT_NEEDED]
        self.reason = _no_grip_reason(contacts, counted, parts)
        if square and self.counter > CONTACTS_NEEDED:
            best = min(square, key=lambda contact: (-round(contact.alignment, _ALIGNMENT_DIGITS), contact.name))
            self.part, self.reason = best.name, ""

    def _look_after(self, time: int) -> int:
        """Return the time of the earliest permitted check at or after `time` [ns]."""
        if self.phase is not None:
            return time + (self.phase - time) % CHECK_PERIOD
        return time if self._last_look is None else max(time, self._last_look + CHECK_PERIOD)


def _no_grip_reason(contacts: Sequence[CupContact], counted: Sequence[CupContact], parts: Sequence[CupContact]) -> str:
    """Return the reason for no grip; if only the counter is too low, that a second check is due."""
    if not contacts:
        return "no contact"
    if not counted:
        return f"contact with something fixed: {contacts[0].name}"
    if not parts:
        return f"contact with {counted[0].name}, which is no part"
    best = max(contact.alignment for contact in parts)
    if best <= ALIGNMENT_NEEDED:
        tilt = degrees(acos(max(-1.0, best)))
        return f"tilted: {tilt:.1f} deg > {degrees(acos(ALIGNMENT_NEEDED)):.1f}"
    return "waiting for a second check"


class VacuumGripper(VacuumCheck, Device):
    """Gripper device: `set_enabled` switches the vacuum, and each result of the suction logic is carried out.

    Args:
        parts: the parts of the cell.
        phase: see `VacuumCheck`.
        belts: names of the belts' geoms, which count as moving.
        arm: the arm that carries it.

    Attributes:
        on_change: callbacks that run when it is switched, grips or releases.
        drop_target: each check calls it with name and world_T_part of a held part. It returns the pose to drop the
            part at, or None.
    """

    def __init__(self, parts: Parts, arm: Arm, phase: int | None = None, belts: Sequence[str] = ()) -> None:
        Device.__init__(self, f"gripper_{arm.namespace}" if arm.namespace else "gripper")
        VacuumCheck.__init__(self, phase)
        self.parts, self.arm = parts, arm
        self._belt_names = tuple(belts)
        self.on_change: list[Callable[[VacuumGripper], None]] = []
        self.drop_target: Callable[[str, Pose], Pose | None] = lambda _name, _pose: None
        parts.on_taken.append(self._notice_taken)

    @classmethod
    def of(cls, trial: Trial, parts: Parts) -> dict[str, Self]:
        """Return the vacuum grippers of a trial's arms, by the names of these."""
        belts = [each.body for each in trial.layout.belts]
        return {arm.name: cls(parts, arm, phase_of(trial), belts) for arm in trial.arms if arm.tool.kind == "vacuum"}

    def attach(self, simulation: Simulation) -> None:
        """Look up the cup and the belt."""
        super().attach(simulation)
        model = simulation.model
        prefix = self.arm.prefix
        self._body = model.body(prefix + GRIPPER).id
        self._cup = model.geom(prefix + CUP_GEOM).id
        self._face = model.geom(prefix + CUP_FACE_GEOM).id
        self._belts = [model.geom(name).id for name in self._belt_names]

    def set_enabled(self, enabled: bool) -> None:  # noqa: FBT001
        """Switch the vacuum on or off. Switching it off releases the part at once."""
        if enabled == self.enabled:
            return
        if enabled:
            self.enable(self.simulation.now)
        else:
            self._release(self.disable())
        self._plan()
        self._notify()

    def begin_with(self, kind: str) -> None:
        """Hold the first part of a type that is in play, as a run begins: its top in the middle of the cup.

        Raises:
            UsageError: there is none, or the part has no surface before the cup.
        """
        part = next((each for each in self.parts.all if each.type == kind and each.name in self.parts.in_play), None)
        if part is None:
            raise UsageError(f"start: the cell has no part of type {kind!r} for the cup to hold")
        self._bring(part)
        self.enable(self.simulation.now)
        self.part, self.reason = part.name, ""
        self._hold(part)
        self._plan()
        self._notify()

    def _bring(self, part: WorldPart) -> None:
        """Bring a part to the cup along its axis, which is the part's z axis, until they touch."""
        simulation = self.simulation
        simulation.refresh()
        model, data = simulation.model, simulation.data
        cup = Pose(tuple(data.xpos[self._body].tolist()), tuple(data.xquat[self._body].tolist()))
        below = 2 * MAX_PART_SIZE
        for _ in range(_STEPS):
            self.parts.place(part, cup @ Pose((0.0, 0.0, -below)))
            simulation.refresh()
            cutoff = 2 * below
            gap = min(mujoco.mj_geomDistance(model, data, self._face, geom, cutoff, None) for geom in part.geoms)
            if gap <= _TOUCH:
                return
            # no surface is nearer along the axis than it is at all, so the part never goes too far
            below -= gap
            if below <= -MAX_PART_SIZE:
                break
        raise UsageError(f"start: {part.type} has no surface in the middle of its top for the cup to hold")

    def handle_look(self) -> None:
        """Check the contacts, and carry out the result."""
        held, target = self.part, None
        if held is not None:
            target = self.drop_target(held, self.parts.pose(self.parts.part(held)))
        self.check(self.simulation.now, self.contacts(), is_dropped=target is not None)
        if held is None and self.part is not None:
            self._hold(self.parts.part(self.part))
        elif held is not None and target is not None:
            self._release(held)
            self.parts.place(self.parts.part(held), target)
        self._plan()
        if self.part != held:
            self._notify()

    def contacts(self) -> list[CupContact]:
        """Return the cup's contacts: those of the engine in the last step, and those of the plain disc in its place.

        The cup's edge is bevelled where the original's gripper is a plain disc. A part may meet the bevel only, as the
        mark of a disk does. Without the disc it would seem to be tilted by the bevel's angle, or not to be touched yet.
        """
        data = self.simulation.data
        if not data.ncon:
            return self._before_face()
        pairs = data.contact.geom
        axis = np.array(data.xmat[self._body].reshape(3, 3)[:, 2])
        touching = []
        for row in np.flatnonzero((pairs == self._cup).any(axis=1)).tolist():
            first, second = pairs[row].tolist()
            towards_cup = 1.0 if second == self._cup else -1.0
            alignment = towards_cup * float(data.contact.frame[row][:3] @ axis)
            touching.append(self._contact(first if second == self._cup else second, alignment))
        return touching + self._before_face()

    def _before_face(self) -> list[CupContact]:
        """Return the contacts of the parts that the plain disc touches."""
        simulation = self.simulation
        simulation.refresh()
        model, data = simulation.model, simulation.data
        axis = data.xmat[self._body].reshape(3, 3)[:, 2]
        centre = data.xpos[self._body]
        ends: NDArray[np.float64] = np.zeros(6)
        touching = []
        for part in self.parts.inside(centre - MAX_PART_SIZE, centre + MAX_PART_SIZE):
            for geom in part.geoms:
                distance = mujoco.mj_geomDistance(model, data, self._face, geom, _NEAR, ends)
                if distance < _NEAR and distance != 0.0:
                    # from the part to the disc, also where they overlap
                    normal = (ends[:3] - ends[3:]) / distance
                    touching.append(self._touched(part, float(normal @ axis)))
        return touching

    def _contact(self, geom: int, alignment: float) -> CupContact:
        model = self.simulation.model
        body = int(model.geom_bodyid[geom])
        part = self.parts.by_body.get(body)
        if part is not None:
            return self._touched(part, alignment)
        name = model.geom(geom).name or model.body(body).name
        moves = geom in self._belts or int(model.body_treeid[body]) >= 0
        return CupContact(name, ContactKind.MOVABLE if moves else ContactKind.FIXED, alignment)

    def _touched(self, part: WorldPart, alignment: float) -> CupContact:
        """Return the contact with a part; a part that is locked to a tray counts as fixed."""
        return CupContact(part.name, ContactKind.FIXED if self.parts.is_locked(part) else ContactKind.PART, alignment)

    def _hold(self, part: WorldPart) -> None:
        """Weld the part to the cup in its present pose, without pulling in or centring it."""
        simulation = self.simulation
        simulation.refresh()
        data = simulation.data
        position, quaternion = data.xpos[self._body].tolist(), data.xquat[self._body].tolist()
        gripper_T_world = Pose(tuple(position), tuple(quaternion)).inverse()
        engage_weld(simulation, part.grips[self.arm.name], self._body, gripper_T_world @ self.parts.pose(part))

    def _release(self, name: str | None) -> None:
        if name is not None:
            part = self.parts.part(name)
            self.simulation.data.eq_active[part.grips[self.arm.name]] = 0
            self.simulation.keep_awake(part.body)

    def _notice_taken(self, part: WorldPart) -> None:
        """Note that a part is no longer in the cup, if it was."""
        if part.name == self.part:
            self.lose("taken away")
            self._notify()

    def _plan(self) -> None:
        # Only the check due next is an event, as commands move it.
        self.simulation.cancel(self, "look")
        if self.next_look < NEVER:
            self.simulation.schedule(self, "look", at=self.next_look)

    def _notify(self) -> None:
        for listener in self.on_change:
            listener(self)


def phase_of(trial: Trial) -> int | None:
    """Return the phase of the gripper's checks [ns]; None: as soon as it is switched on."""
    phase = trial.circumstances.gripper_phase
    return None if phase is None else nanoseconds(phase)
