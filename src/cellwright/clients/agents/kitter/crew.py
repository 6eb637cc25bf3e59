"""Arms of a cell at work: each builds the kits of the trays that are nearest to it, and only one moves at a time.

The others stand at home meanwhile. So what moves keeps its distance from what stands, and two arms never meet.
"""

import copy
import math
from collections.abc import Sequence
from typing import NamedTuple

from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.supply import Supply
from cellwright.clients.agents.kitter.workplace import BeltPlace, TrayPlace, Workplace
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

_OVER_TRAY = 0.1
"""Height [m] of the tool over a tray for which its reach is computed."""


class Worker(NamedTuple):
    """An arm, its hand, its places of the cell, and the parts that it can take."""

    workplace: Workplace
    arm: KitterArm
    hand: Manipulator
    supply: Supply


class Crew:
    """Workers by the stations that they build kits at.

    Args:
        workers: at least one.

    Raises:
        UsageError: an arm stands too near to another one.
    """

    def __init__(self, workers: Sequence[Worker]) -> None:
        self._workers = workers
        places = nearest([worker.workplace for worker in workers])
        self._by_station = {number: workers[index] for number, index in places.items()}
        for worker in workers if len(workers) > 1 else ():
            fault = worker.arm.fault_at_home()
            if fault is not None:
                raise UsageError(f"at home {fault}; give the arms other homes in the cell's section arms: home")

    def at(self, station: TrayPlace) -> Worker:
        """Return the worker of a station."""
        return self._by_station[station.number]

    def call(self, station: TrayPlace) -> Worker:
        """Return the worker of a station, after the other arms have gone home.

        Raises:
            UsageError: one of them finds no way home.
        """
        called = self.at(station)
        for worker in self._workers:
            if worker is not called and not worker.arm.go_home():
                raise UsageError(f"{worker.arm.name} finds no way home, where it waits while another arm moves")
        return called


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


def overview(workplaces: Sequence[Workplace]) -> Workplace:
    """Return the places of all arms as one: stations as their arms work them, belts as far as one of them reaches."""
    if len(workplaces) == 1:
        return workplaces[0]
    whole = copy.copy(workplaces[0])
    whole.stations = {number: workplaces[index].stations[number] for number, index in nearest(workplaces).items()}
    belts: dict[str, BeltPlace] = {}
    for each in (belt for place in workplaces for belt in place.belts):
        known = belts.get(each.belt.name, each)
        belts[each.belt.name] = BeltPlace(each.belt, min(known.first, each.first), max(known.last, each.last))
    whole.belts = tuple(belts.values())
    return whole
