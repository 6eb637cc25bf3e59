"""Shares of the places of a cell that each arm reaches with its tool down, and that are clear of everything else."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.checks.reach import Posture, Reach, reaches
from cellwright.cell.checks.surfaces import points_on, surfaces_in
from cellwright.cell.model.build import build_world
from cellwright.config.layout.arm_models import moving_links
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.surfaces import Surface
from cellwright.config.trial.trial import Trial
from cellwright.motion.solver import Margins


class State(IntEnum):
    """State of a point for an arm."""

    OUT = 0
    """No posture brings the tool there."""
    BLOCKED = 1
    """The arm touches something in each posture that was tried."""
    CLEAR = 2
    """The arm touches nothing in some posture."""


@dataclass(frozen=True)
class PlaceReach:
    """Reach of an arm over a place.

    Attributes:
        arm: name of the arm.
        surface: the place.
        states: `State` of each point of `points_on(surface)`.
        worst: smallest margins of the postures at its clear points; None without any.
    """

    arm: str
    surface: Surface
    states: NDArray[np.int8]
    worst: Margins | None

    @property
    def reached(self) -> float:
        """Share of the points that the arm reaches."""
        return float(np.mean(self.states > State.OUT))

    @property
    def clear(self) -> float:
        """Share of the points that it reaches without touching anything."""
        return float(np.mean(self.states == State.CLEAR))


def place_reaches(trial: Trial) -> Iterator[PlaceReach]:
    """Yield the reach of each arm over each bin, belt, AGV and tray of a trial's cell.

    Parts are left out, AGVs are at their stations, and other arms at home. An arm may touch itself, as in a run. Its
    hand may touch the place: a cup at the wall of a bin does not make the bin a bad place.

    Example:
        >>> import cellwright
        >>> first = next(place_reaches(cellwright.load_trial("lesson")))
        >>> first.arm, first.surface.name, round(first.reached, 1)
        ('arm', 'bin1', 0.5)
    """
    contacts = _Contacts(trial)
    for arm, reach in zip(trial.arms, reaches(trial), strict=True):
        for surface in surfaces_in(trial):
            yield _Place(contacts, arm, reach, surface).reach()


@dataclass(frozen=True)
class _Place:
    """A place for an arm."""

    contacts: _Contacts
    arm: Arm
    reach_of_arm: Reach
    surface: Surface

    def reach(self) -> PlaceReach:
        """Return the reach of the arm over the place."""
        points, reach = points_on(self.surface), self.reach_of_arm
        states = np.where(reach.mask(points), State.BLOCKED, State.OUT).astype(np.int8)
        margins: list[Margins] = []
        for row, column in np.argwhere(states):
            posture = self._clear_posture(points[row, column])
            if posture is not None:
                states[row, column] = State.CLEAR
                margins.append(reach.arm.solver.margin(posture.q))
        worst = Margins(*(min(each) for each in zip(*margins, strict=True))) if margins else None
        return PlaceReach(self.arm.name, self.surface, states, worst)

    def _clear_posture(self, point: NDArray[np.float64]) -> Posture | None:
        """Return the posture of best mobility at a point in which the arm touches nothing."""
        for posture in self.reach_of_arm.postures(point):
            touching = self._touching(posture)
            if not touching:
                return posture
            if touching <= self._hand:
                # another yaw of the hand moves nothing else
                turned = next((each for each in self.reach_of_arm.yaws(posture) if not self._touching(each)), None)
                if turned is not None:
                    return turned
        return None

    def _touching(self, posture: Posture) -> set[str]:
        """Return the links that touch something else, but for the hand at the place."""
        found = self.contacts.of(self.arm, self.reach_of_arm.arm.joints(posture.position, posture.q))
        own = self.contacts.bodies[self.surface.key]
        return {link for link, other in found if not (other == own and link in self._hand)}

    @cached_property
    def _hand(self) -> set[str]:
        """Links behind the last joint."""
        chain = self.reach_of_arm.arm.chain
        return {name for name, link in chain.links.items() if link.joints == len(chain.joints)}


class _Contacts:
    """Contacts of arms in the cell of a trial without parts.

    Attributes:
        bodies: body of each surface, by its key.
    """

    def __init__(self, trial: Trial) -> None:
        options = replace(trial.options, fill_demo_tray=False)
        world = build_world(replace(trial, bin_parts=(), extra_parts=(), belt_parts=(), options=options))
        self._model = world.model
        self._data = mujoco.MjData(self._model)
        self._start = world.initial_qpos
        layout = trial.layout
        names = {f"cell.bins.{each.name}": each.name for each in layout.bins}
        names |= {f"cell.belts.{each.name}": each.body for each in layout.belts}
        names |= {f"cell.carriers.{each.name}": each.tray_link for each in trial.carriers}
        names |= {f"cell.trays.{each.name}": each.tray_link for each in layout.trays}
        self.bodies = {key: self._body(name) for key, name in names.items()}
        self._links = {
            arm.name: {self._body(name): name.removeprefix(arm.prefix) for name in moving_links(arm, trial.arm_models)}
            for arm in trial.arms
        }

    def of(self, arm: Arm, joints: Mapping[str, float]) -> set[tuple[str, int]]:
        """Return the links of an arm that touch something, each with the other body, at joint positions [rad; m]."""
        model, data, own = self._model, self._data, self._links[arm.name]
        data.qpos[:] = self._start
        for name, position in joints.items():
            data.qpos[model.joint(arm.prefix + name).qposadr[0]] = position
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        if not data.ncon:
            return set()
        contact = data.contact
        pairs = model.geom_bodyid[contact.geom[contact.dist < 0.0]].tolist()
        both = [pair for one, other in pairs for pair in ((one, other), (other, one))]
        return {(own[one], other) for one, other in both if one in own and other not in own}

    def _body(self, name: str) -> int:
        return int(self._model.body(name).id)
