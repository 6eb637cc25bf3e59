"""View of a cell for the conditions of its task: parts, holders, contents of trays, and links of robots."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cellwright.cell.competition import Competition
from cellwright.cell.devices.grippers import Gripper, tool_points
from cellwright.cell.devices.kit_tray import KitTray, TrayPart
from cellwright.cell.devices.parts import Parts
from cellwright.cell.kitting.attainable import AttainableScore, attainable_score
from cellwright.cell.kitting.inventory import TrayObject, part_type, trimmed_name
from cellwright.cell.model.build import WorldPart
from cellwright.cell.model.clones import clone_name
from cellwright.config.trial.trial import Trial
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose, Vector3

REST_SPEED = 0.01
"""Speed of a part's origin [m/s] up to which it is at rest."""
REST_TURNING = 0.1
"""Angular speed of a part [rad/s] up to which it is at rest."""


@dataclass(frozen=True)
class TaskView:
    """View of a cell for the conditions of its task. It changes nothing.

    Attributes:
        simulation: the cell's.
        parts: its parts.
        trays: its trays, by the names of their stations.
        grippers: its grippers, by the names of their arms.
        competition: its referee and score.
    """

    simulation: Simulation
    parts: Parts
    trays: Mapping[str, KitTray]
    grippers: Mapping[str, Gripper]
    competition: Competition

    @property
    def trial(self) -> Trial:
        """The trial of the run."""
        return self.competition.trial

    @cached_property
    def attainable(self) -> AttainableScore:
        """Attainable points of every start of the trial: starts differ in poses and circumstances alone."""
        return attainable_score(self.trial)

    def of_type(self, kind: str) -> Iterator[WorldPart]:
        """Yield the parts in play of a type."""
        return (part for part in self.parts.all if part.type == kind and part.name in self.parts.in_play)

    def is_held(self, part: WorldPart, by: str | None = None) -> bool:
        """Return whether something holds a part: an arm or a hand, or the one of this name."""
        active = self.simulation.data.eq_active
        return any(active[weld] for name, weld in part.grips.items() if by in (None, name))

    def is_resting(self, part: WorldPart) -> bool:
        """Return whether a part is at rest in the world and not held."""
        velocity = self.simulation.data.qvel[part.dof : part.dof + 6]
        speed, turning = float(np.linalg.norm(velocity[:3])), float(np.linalg.norm(velocity[3:]))
        return speed <= REST_SPEED and turning <= REST_TURNING and not self.is_held(part)

    def start_of(self, part: WorldPart) -> Pose:
        """Return world_T_part at the start: where the part lay by its file, or where the belt brought it."""
        name = trimmed_name(part.name)
        if part.name != clone_name(name):
            return part.start
        trial, kind = self.trial, part_type(part.name)
        number = int(name.rpartition("_")[2])
        # clones of a type are numbered belt by belt, and those of a belt through its list, round by round
        counts = Counter(each.belt for each in trial.belt_parts if each.type == kind)
        belt = [each.name for each in trial.layout.belts if number >= trial.first_clones(each.name).get(kind, 0)][-1]
        listed = sorted((e for e in trial.belt_parts if e.type == kind and e.belt == belt), key=lambda e: e.time)
        place = listed[(number - trial.first_clones(belt).get(kind, 0)) % counts[belt]]
        return trial.layout.belt(belt).spawn @ place.pose

    def tool_distance(self, point: Vector3, by: str | None = None) -> float:
        """Return the distance from a point of the world to the nearest cup, grasp point or hand [m].

        It is infinite without any; with `by`, of that arm or hand alone.
        """
        self.simulation.refresh()
        data = self.simulation.data
        places = (
            data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.asarray(offset)
            for name, body, offset in self._tools()
            if by in (None, name)
        )
        return min((float(np.linalg.norm(place - np.asarray(point))) for place in places), default=math.inf)

    def _tools(self) -> Iterator[tuple[str, int, list[float]]]:
        """Yield name, body and point in its frame [m] of everything that holds parts."""
        model = self.simulation.model
        for name, gripper in self.grippers.items():
            for body, point in tool_points(model, [gripper], lambda body: body):
                yield name, body, point
        for robot in self.trial.layout.robots:
            for hand in robot.hands:
                yield hand.name, int(model.geom(hand.name).bodyid[0]), [0.0, 0.0, 0.0]

    def standing(self, tray: str) -> tuple[TrayPart, ...]:
        """Return what stands on a tray now, with poses in its frame."""
        return self.trays[tray].find_parts()

    def lying(self, tray: str) -> tuple[TrayObject, ...]:
        """Return what lies on a tray now, at rest and not held, as the referee would see it."""
        return tuple(
            TrayObject(each.name, part_type(each.name), self.is_faulty(each.name), each.pose)
            for each in self.standing(tray)
            if self.is_resting(self.parts.part(each.name))
        )

    def is_faulty(self, name: str) -> bool:
        """Return whether a part is faulty, by its full name."""
        return trimmed_name(name) in self.trial.faulty_parts

    def link(self, robot: str, link: str) -> Vector3:
        """Return the origin of a robot's link in the world [m]."""
        self.simulation.refresh()
        prefix = next(each.prefix for each in self.trial.layout.robots if each.name == robot)
        x, y, z = self.simulation.data.xpos[self.simulation.model.body(f"{prefix}{link}").id].tolist()
        return (x, y, z)
