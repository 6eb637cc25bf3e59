"""Parallel gripper: a device that moves two fingers and holds what their pads press on.

The gripper checks its pads a hundred times a second, from a command until it stands still at its goal with nothing
between the pads. It holds a part that both pads have pressed on for 0.1 s without slipping.

- `weld`: a weld then holds the part, and the pads stand back from it by 0.2 mm. So it does not creep, costs no
  contacts, and may be left out of collision detection. The weld breaks when it has borne more than the pads' friction
  could for 0.05 s, and when the fingers open. Loads in all directions count alike; torques do not.
- `friction`: the pads go on pressing, and the engine's contacts hold the part.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar, Final, NamedTuple, Self

import mujoco
import numpy as np

from cellwright.config.gripper import ParallelGripperSettings
from cellwright.config.gripper_links import GripperNames
from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.gripper_model import STIFFNESS
from cellwright.mechanism.welds import engage_weld, find_weld, grip_name, weld_force
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

CHECK_PERIOD: Final = NANOSECONDS // 100
"""Time between two checks of the pads [ns]."""

CHECKS_TO_HOLD: Final = 10
"""Number of checks in a row that find both pads pressing on a part before it is held."""

CHECKS_TO_LOSE: Final = 5
"""Number of checks in a row with too high a load, or without both pads on the part, before it is lost."""

CHECKS_TO_STALL: Final = 10
"""Number of checks in a row without motion before the fingers count as stalled."""

GOAL_TOLERANCE: Final = 0.0005
"""Deviation [m] from its goal at which the gripper has reached it."""

STILL: Final = 0.001
"""Speed [m/s] of the distance between the pads below which the fingers do not move."""

_SLIP = 0.02
"""Speed [m/s] of a part in the palm's frame from which on it slips."""
_FACING = 0.9
"""Cosine between a contact's normal and the fingers' axis, above which the contact is with a pad's face."""
_MOVED = 0.001
"""Change of the distance between the pads [m] after which stalled fingers go on to their goal."""
_CLEARANCE = 0.0002
"""Distance [m] of each pad from a part that a weld holds."""
_RESERVE = 3.0
"""Deviation of a servo from the setpoint of stalled fingers, in terms of that which gives the whole force."""
_NOTHING = -1
"""In place of a body's id."""


class GripperReadings(NamedTuple):
    """Distance between the pads [m], its speed [m/s], and the gripping force [N], positive if the fingers close."""

    width: float
    speed: float
    force: float


class ParallelGripper(Device):
    """Device of a parallel gripper. It stands still where a run begins, and holds nothing.

    Args:
        settings: settings of the gripper, as those in the model.
        names: names of the gripper in the model.
        part_of: returns the name of the part that a body is, and None if the body is no part or must not be held now.
        gripper: name of the gripper in the names of its welds, as of `grip_name`.
        name: name of the device.

    Attributes:
        on_change: callbacks that run when it gets or loses a part, and when its fingers reach their goal or stall.
    """

    STATE: ClassVar = (
        "goal", "max_force", "speed", "part", "lost_reason", "reached", "stalled",
        "_body", "_pressed", "_press_count", "_still_count", "_fault_count",
        "_stalled_at", "_start", "_end", "_departure",
    )  # fmt: skip

    def __init__(
        self,
        settings: ParallelGripperSettings,
        names: GripperNames,
        part_of: Callable[[int], str | None],
        *,
        gripper: str = "",
        name: str = "gripper",
    ) -> None:
        super().__init__(name)
        self.settings = settings
        self.on_change: list[Callable[[Self], None]] = []
        self._names = names
        self._part_of = part_of
        self._gripper = gripper
        self._clear()

    def _clear(self) -> None:
        self.goal = 0.0
        """Distance between the pads to move to [m]."""
        self.max_force = self.settings.force
        """Gripping force that is not exceeded [N]."""
        self.speed = self.settings.speed
        """Speed at which the distance between the pads changes [m/s]."""
        self.part: str | None = None
        """Name of the held part."""
        self.lost_reason = ""
        """Reason for the last loss of a part: `released`, `overload`, `slipped`, `taken away`, or that of `drop`."""
        self.reached = True
        """True if the fingers stand at their goal."""
        self.stalled = False
        """True if something keeps the fingers from their goal."""
        self._body = self._pressed = _NOTHING
        self._press_count = self._still_count = self._fault_count = 0
        self._stalled_at = 0.0
        self._start = self._end = 0.0  # of the way of the setpoint [m]
        self._departure = 0  # [ns]

    @property
    def is_holding(self) -> bool:
        """True if a part is held."""
        return self.part is not None

    def attach(self, simulation: Simulation) -> None:
        """Look up palm, pads and servos."""
        super().attach(simulation)
        self._find()
        simulation.on_model.append(self._find)

    def _find(self) -> None:
        model, names = self.simulation.model, self._names
        self._palm = int(model.body(names.palm).id)
        self._pads = [int(model.geom(name).id) for name in names.pads]
        joints = [model.joint(name) for name in names.joints]
        self._positions = [int(joint.qposadr[0]) for joint in joints]
        self._velocities = [int(joint.dofadr[0]) for joint in joints]
        self._servos = [int(model.actuator(name).id) for name in names.joints]
        self._inputs = [int(model.actuator_ctrladr[servo]) for servo in self._servos]
        self._welds: dict[int, int] = {}
        self._limit_force()

    def reset(self) -> None:
        """Hold the fingers where the run begins."""
        self._clear()
        self._limit_force()
        self.goal = self._motion()[0]
        self._drive(self.goal, self.goal)
        self.before_step()

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        super().set_state(state)
        self._limit_force()

    def read(self) -> GripperReadings:
        """Return the present readings. By a weld the fingers hold a part as tightly as they pressed on it."""
        width, speed = self._motion()
        is_welded = self.is_holding and self.settings.holds == "weld"
        force = self.max_force if is_welded else -float(self.simulation.data.actuator_force[self._servos].sum())
        return GripperReadings(width, speed, force)

    def open(self) -> None:
        """Open as far as possible, and release the part."""
        self.move(self.settings.opening)

    def grip(self, max_force: float | None = None) -> None:
        """Close until the pads meet, or press on a part. See `move` for the force."""
        self.move(0.0, max_force)

    def move(self, width: float, max_force: float | None = None, speed: float | None = None) -> None:
        """Move to a distance between the pads. Opening releases the part.

        Args:
            width: distance between the pads [m], from 0 to the opening.
            max_force: gripping force that is not exceeded [N]; None: that of the settings, its largest value.
            speed: speed at which that distance changes [m/s]; None: that of the settings, its largest value.

        Raises:
            UsageError: an argument is out of range; nothing has changed.
        """
        settings = self.settings
        force = settings.force if max_force is None else max_force
        speed = settings.speed if speed is None else speed
        if not 0.0 <= width <= settings.opening:
            raise UsageError(
                f"gripper {self.name!r}: the width must be from 0 to {settings.opening:g} m (got {width:g})"
            )
        if not 0.0 < force <= settings.force:
            raise UsageError(
                f"gripper {self.name!r}: the force must be above 0, at most {settings.force:g} N (got {force:g})"
            )
        if not 0.0 < speed <= settings.speed:
            raise UsageError(
                f"gripper {self.name!r}: the speed must be above 0, at most {settings.speed:g} m/s (got {speed:g})"
            )
        present = self._motion()[0]
        if self.is_holding and width > present + GOAL_TOLERANCE:
            self._lose("released")
        self.goal, self.max_force, self.speed = float(width), float(force), float(speed)
        self.reached = self.stalled = False
        self._still_count = self._press_count = 0
        self._limit_force()
        if not (self.is_holding and settings.holds == "weld"):
            self._drive(present, self.goal)
        self._plan()
        self._notify()

    def stop(self) -> None:
        """Stop the fingers where they are. They go on holding or pressing on what keeps them from their goal."""
        if not (self.reached or self.stalled or self.is_holding):
            self.goal = min(max(self._motion()[0], 0.0), self.settings.opening)
            self._drive(self.goal, self.goal)
            self._notify()

    def take_away(self, body: int) -> None:
        """Release a part that something else takes, if it is held: it is placed elsewhere, or locked."""
        if self.is_holding and body == self._body:
            self.drop("taken away")

    def drop(self, reason: str) -> None:
        """Lose the held part, and go on to the goal."""
        self._lose(reason)
        self._go_on()
        self._notify()

    def before_step(self) -> None:
        """Write the setpoints; stop stepping at the end of their way."""
        way, elapsed = self._end - self._start, (self.simulation.now - self._departure) / NANOSECONDS
        position, speed = self._end, 0.0
        if self.speed * elapsed < abs(way):
            speed = math.copysign(self.speed, way)
            position = self._start + speed * elapsed
        else:
            self.set_stepping(False)
        inputs = self.simulation.data.ctrl
        for address in self._inputs:
            inputs[address], inputs[address + 1] = position / 2, speed / 2

    def handle_check(self) -> None:
        """Check what the pads press on, the load of the weld, and whether the fingers move."""
        before = (self.part, self.reached, self.stalled)
        if self.is_holding and self.settings.holds == "weld":
            self._check_weld()
        else:
            self._check_pads()
        self._check_motion()
        if not self.reached or self.is_holding or self._pressed != _NOTHING or self.stepping:
            self._plan()
        if before != (self.part, self.reached, self.stalled):
            self._notify()

    def _check_weld(self) -> None:
        data = self.simulation.data
        weld = self._weld(self._body)
        if not data.eq_active[weld]:
            self._lose("taken away")
            self._go_on()
            return
        is_high = weld_force(data, weld) > self.settings.pad.friction * self.max_force
        self._fault_count = self._fault_count + 1 if is_high else 0
        if self._fault_count >= CHECKS_TO_LOSE:
            self._lose("overload")
            self._go_on()

    def _check_pads(self) -> None:
        pressed = self._find_pressed()
        self._press_count = self._press_count + 1 if pressed == self._pressed != _NOTHING else int(pressed >= 0)
        self._pressed = pressed
        if self.is_holding:
            self._fault_count = 0 if pressed == self._body else self._fault_count + 1
            if self._fault_count >= CHECKS_TO_LOSE:
                self._lose("slipped")
        elif self._press_count >= CHECKS_TO_HOLD:
            self._hold(pressed)

    def _check_motion(self) -> None:
        width, speed = self._motion()
        self._still_count = self._still_count + 1 if abs(speed) < STILL else 0
        is_there = abs(width - self.goal) <= GOAL_TOLERANCE
        is_welded = self.is_holding and self.settings.holds == "weld"
        if self.stalled:
            if not is_welded and abs(width - self._stalled_at) > _MOVED:
                self.stalled = False
                self._still_count = 0
                self._go_on()
        elif self._still_count >= CHECKS_TO_STALL and not is_there:
            self.stalled, self._stalled_at = True, width
            if not is_welded:
                # the servo gives the whole force, however near to the goal it stalls
                lead = _RESERVE * self.max_force / STIFFNESS
                pressing = width + math.copysign(lead, self.goal - width)
                self._drive(pressing, pressing)
        self.reached = is_there and not self.stepping and not self.stalled

    def _motion(self) -> tuple[float, float]:
        """Return the distance between the pads [m], and its speed [m/s]."""
        qpos, qvel = self.simulation.data.qpos, self.simulation.data.qvel
        (left, right), (dof, other_dof) = self._positions, self._velocities
        return float(qpos[left] + qpos[right]), float(qvel[dof] + qvel[other_dof])

    def _find_pressed(self) -> int:
        """Return the part that both pads press on without slipping, as a body's id."""
        # so the result does not depend on whether a client has asked for positions in this tick
        self.simulation.refresh()
        model, data = self.simulation.model, self.simulation.data
        contact = data.contact
        pairs = contact.geom
        rows = np.flatnonzero(((pairs == self._pads[0]) | (pairs == self._pads[1])).any(axis=1))
        if len(rows) < 2:
            return _NOTHING
        axis = data.xmat[self._palm].reshape(3, 3)[:, 1]
        facing = (contact.frame[rows, :3] @ axis).tolist()
        addresses = contact.efc_address[rows].tolist()
        pressed: tuple[set[int], set[int]] = (set(), set())
        for (first, second), address, cosine in zip(pairs[rows].tolist(), addresses, facing, strict=True):
            if address >= 0 and abs(cosine) > _FACING and data.efc_force[address] > 0.0:
                pad, other = (first, second) if first in self._pads else (second, first)
                pressed[self._pads.index(pad)].add(int(model.geom_bodyid[other]))
        both = sorted(body for body in pressed[0] & pressed[1] if self._part_of(body) is not None)
        return next((body for body in both if self._slip(body) < _SLIP), _NOTHING)

    def _slip(self, body: int) -> float:
        """Return the speed [m/s] of a body's origin in the palm's frame."""
        model, data = self.simulation.model, self.simulation.data
        kind = mujoco.mjtObj.mjOBJ_XBODY
        palm, part = np.zeros(6), np.zeros(6)
        mujoco.mj_objectVelocity(model, data, kind, self._palm, palm, 0)
        mujoco.mj_objectVelocity(model, data, kind, body, part, 0)
        wx, wy, wz, vx, vy, vz = palm.tolist()
        x, y, z = (data.xpos[body] - data.xpos[self._palm]).tolist()
        px, py, pz = part[3:].tolist()
        return math.hypot(px - vx - wy * z + wz * y, py - vy - wz * x + wx * z, pz - vz - wx * y + wy * x)

    def _hold(self, body: int) -> None:
        self.part, self._body, self._fault_count = self._part_of(body), body, 0
        if self.settings.holds == "friction":
            return
        simulation = self.simulation
        simulation.refresh()
        palm_T_part = self._pose(self._palm).inverse() @ self._pose(body)
        engage_weld(simulation, self._weld(body), self._palm, palm_T_part)
        # fingers that press on would cost contacts in each step
        width = self._motion()[0] + 2 * _CLEARANCE
        self._drive(width, width)

    def _lose(self, reason: str) -> None:
        if self.settings.holds == "weld":
            self.simulation.data.eq_active[self._weld(self._body)] = 0
            self.simulation.keep_awake(self._body)
        self.part, self.lost_reason = None, reason
        self._body = self._pressed = _NOTHING
        self._press_count = self._fault_count = 0

    def _go_on(self) -> None:
        """Move on to the goal, after what was between the pads is gone."""
        self.stalled, self._still_count = False, 0
        self._drive(self._motion()[0], self.goal)

    def _weld(self, body: int) -> int:
        if body not in self._welds:
            name = grip_name(self.simulation.model.body(body).name, self._gripper)
            weld = find_weld(self.simulation.model, name)
            if weld is None:
                raise UsageError(f"gripper {self.name!r}: the model has no weld {name!r}; add one for each part")
            self._welds[body] = weld
        return self._welds[body]

    def _pose(self, body: int) -> Pose:
        data: Any = self.simulation.data
        return Pose(tuple(data.xpos[body].tolist()), tuple(data.xquat[body].tolist()))

    def _drive(self, start: float, end: float) -> None:
        """Move the setpoint from one distance between the pads [m] to another."""
        self._start, self._end, self._departure = start, end, self.simulation.now
        self.set_stepping(True)

    def _limit_force(self) -> None:
        # the engine keeps the limit in its model, and this device in its state
        self.simulation.model.actuator_forcerange[self._servos] = (-self.max_force / 2, self.max_force / 2)

    def _plan(self) -> None:
        self.simulation.cancel(self, "check")
        self.simulation.schedule(self, "check", at=self.simulation.now + CHECK_PERIOD)

    def _notify(self: Self) -> None:
        for listener in self.on_change:
            listener(self)
