"""Arms of a cell at work: each builds the kits of the trays that are nearest to it, with what it reaches.

What they agree on is in `agreement`, and how they keep apart in `regions`.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from cellwright.clients.agents.kitter.agreement import Share
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.supply import Supply
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.util.pose import Pose

_OVER_TRAY = 0.1
"""Height [m] of the tool over a tray for which its reach is computed."""


class Worker(NamedTuple):
    """An arm, its hand, its places of the cell, the parts that it can take, and its share in the work.

    Attributes:
        title: name of the arm, for lines about what it does; empty if it is the only one.
    """

    workplace: Workplace
    arm: KitterArm
    hand: Manipulator
    supply: Supply
    share: Share
    title: str = ""


def nearest(workplaces: Sequence[Workplace]) -> dict[int, int]:
    """Return which workplace has the arm nearest to each station among those that reach it, by the station's number."""

    def cost(place: Workplace, number: int) -> tuple[bool, float]:
        station, arm = place.stations[number], place.postures
        x, y, _ = station.world_T_tray.position
        reached = arm.reaches(Pose((x, y, station.surface + _OVER_TRAY)), station.rail)
        bx, by, _ = arm.tool(arm.figures.home).position
        return not reached, math.hypot(x - bx, y - by)

    numbers = range(len(workplaces))
    return {
        station: min(numbers, key=lambda index: cost(workplaces[index], station)) for station in workplaces[0].stations
    }


def share_out(workplaces: Sequence[Workplace]) -> list[Workplace]:
    """Return the places of each arm as it works them: its own stations, and belts from its stretch on.

    Of arms that reach one belt, that of the foremost stations takes parts where they come first, and the others farther
    on: so they need not wait for each other.
    """
    if len(workplaces) == 1:
        return [*workplaces]
    workers, found = nearest(workplaces), []
    for index, each in enumerate(workplaces):
        own = copy.copy(each)
        own.stations = {number: place for number, place in each.stations.items() if workers[number] == index}
        own.others = tuple(place for number, place in each.stations.items() if workers[number] != index)
        found.append(own)
    for name in sorted({belt.belt.name for each in found for belt in each.belts}):
        _share_belt(name, [each for each in found if each.stations and each.belt(name) is not None])
    return found


def _share_belt(name: str, workplaces: Sequence[Workplace]) -> None:
    def station(place: Workplace) -> float:
        belt = place.belt(name)
        assert belt is not None
        return sum(belt.belt.along(each.world_T_tray.position) for each in place.stations.values()) / len(
            place.stations
        )

    stretches = [belt for place in workplaces for belt in place.belts if belt.belt.name == name]
    start = min((each.first for each in stretches), default=0.0)
    way = max((each.last for each in stretches), default=0.0) - start
    for index, place in enumerate(sorted(workplaces, key=station)):
        first = start + way * index / len(workplaces)
        place.belts = tuple(
            replace(each, first=min(max(each.first, first), each.last)) if each.belt.name == name else each
            for each in place.belts
        )
