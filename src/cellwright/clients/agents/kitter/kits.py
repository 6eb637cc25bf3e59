"""The kits that are to be built, and how far they are."""

from __future__ import annotations

from dataclasses import dataclass, field

from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc
from cellwright.clients.agents.kitter.placing import STATIONS, Station
from cellwright.clients.agents.kitter.tray_plan import find_place
from cellwright.util.pose import Pose


@dataclass
class Task:
    """One part of a kit.

    Attributes:
        type: of the part.
        tray_T_goal: where it was ordered.
        tray_T_part: where it lies on the tray; None as long as it does not.
        given_up: why it is not brought; empty as long as it may be.
        corrected: whether it was put right once.
        losses: how often a part for it was lost on the way to the tray, or off it.
    """

    type: str
    tray_T_goal: Pose
    tray_T_part: Pose | None = None
    given_up: str = ""
    corrected: bool = False
    losses: int = 0

    @property
    def is_open(self) -> bool:
        """Whether there is something left to do."""
        return self.tray_T_part is None and not self.given_up


@dataclass
class Kit:
    """A kit that is to be built.

    Attributes:
        kit_type: its name.
        tasks: its parts.
        catalogue: the part types that can be handled.
        station: the AGV that it is built on.
        is_sent: whether nothing more can be done for it.
        faulty: type and place on the tray of faulty parts that could not be taken away.
        cleanings: how often something was taken off its tray that does not belong there.
        sendings: how often the AGV was asked to go.
    """

    kit_type: str
    tasks: list[Task]
    catalogue: Catalogue
    station: Station = field(default_factory=lambda: STATIONS[1])
    is_sent: bool = False
    faulty: list[tuple[str, Pose]] = field(default_factory=list)
    cleanings: int = 0
    sendings: int = 0

    @property
    def open_tasks(self) -> list[Task]:
        """The parts that are still to come."""
        return [task for task in self.tasks if task.is_open]

    @property
    def lying(self) -> list[tuple[str, Pose]]:
        """Type and place on the tray of the parts that lie there."""
        return [(task.type, task.tray_T_part) for task in self.tasks if task.tray_T_part is not None]

    def taken(self, but: Task) -> list[Disc]:
        """What is taken on the tray: where parts lie, and where others were ordered on it that still come.

        Args:
            but: the part that room is looked for; it does not count itself.
        """
        figures = self.catalogue.figures
        discs = [disc for part_type, tray_T_part in self.faulty for disc in figures(part_type).covers(tray_T_part)]
        for task in self.tasks:
            if task is but or task.type not in self.catalogue:
                continue
            if task.tray_T_part is not None:
                discs += figures(task.type).covers(task.tray_T_part)
            elif task.is_open:
                place = find_place(figures(task.type), task.tray_T_goal, ())
                if place is not None and place.is_ordered:
                    discs += figures(task.type).covers(place.tray_T_part)
        return discs
