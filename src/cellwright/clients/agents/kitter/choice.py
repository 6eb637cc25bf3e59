"""Choices of the kitter: the station of a kit, its next part, a part of the belt to keep, and why parts are missing."""

from collections import Counter
from collections.abc import Sequence
from functools import partial

from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.crew import Worker
from cellwright.clients.agents.kitter.kits import KitTask, OrderBook, Task, is_known_faulty, strays
from cellwright.clients.agents.kitter.perception import Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.workplace import TrayPlace

KEEPING_HORIZON = 8.0
"""Time [s] within which a part that no order has yet must arrive to be kept."""


class Choice:
    """Choices by what the cameras see and what is still to do."""

    def __init__(self, view: CellView, orders: OrderBook, worker: Worker) -> None:
        self._view = view
        self._orders = orders
        self._worker = worker
        self._supply = worker.supply

    def missing(self) -> Counter[tuple[str, str, str]]:
        """Return the number of ordered parts that are missing, by type of kit, type of part, and reason."""
        return Counter(
            (kit.kit_type, task.type, self._why_not(kit, task))
            for kit in self._orders.kits
            for task in kit.tasks
            if task.tray_T_part is None and self._worker.share.reports(kit.kit_type)
        )

    def _why_not(self, kit: KitTask, task: Task) -> str:
        if task.given_up:
            return task.given_up
        return self._supply.why_none(task.type) if kit.is_sent else "the run ended first"

    def give_station(self, kit: KitTask) -> bool:
        """Begin a kit at the AGV or fixed tray that suits it best; return False if none is there."""
        allowed = [each for each in self._free_stations() if each.location in kit.allowed]
        if not allowed or not self._worker.share.take_kit(kit.kit_type, kit.allowed):
            return False
        self._view.look(*self._view.workplace.bin_areas, *(each.area for each in allowed))
        kit.station = min(allowed, key=partial(self._station_cost, kit, self._view.parts_in_bins()))
        kit.is_begun = True
        # each station is taken or free, so none comes back
        if len(self._free_stations()) + len(self._taken_stations()) == len(self._view.workplace.stations):
            self._view.watch_stations(False)
        return True

    def has_station(self) -> bool:
        """Return whether a station is free that suits an open kit."""
        free = {each.location for each in self._free_stations()}
        return any(not free.isdisjoint(kit.allowed) for kit in self._orders.open_kits() if not kit.is_begun)

    def _taken_stations(self) -> set[int]:
        return {each.station.number for each in self._orders.open_kits() if each.is_begun}

    def _free_stations(self) -> list[TrayPlace]:
        taken, stations = self._taken_stations(), self._view.workplace.stations
        return [each for number, each in stations.items() if number not in taken and self._view.is_ready(number)]

    def _station_cost(self, kit: KitTask, lying: Sequence[Sighting], station: TrayPlace) -> tuple[int, bool, float]:
        """Return a key that is smaller for a station that suits a kit better, with parts that lie in the bins.

        First, parts of it may have been kept on the tray there. Second, the belt may bring a part but once. If it falls
        beside AGV 1, it is lost: the trials that were published before the competition of 2017 have such regions over
        both AGVs or over AGV 1, so such kits go to AGV 2. Third, the way of the rail counts.
        """
        types = dict.fromkeys(task.type for task in kit.tasks)  # in their order: what follows asks and adds up
        kept = sum(part.type in types for part in self._view.parts_on_tray(station))
        is_risky = station.number == 1 and any(self._supply.is_on_belt_alone(each) for each in types)
        way = [
            min(
                (
                    abs(self._worker.workplace.rail_beside(*p.world_T_part.position[:2]) - station.rail)
                    for p in lying
                    if p.type == each
                ),
                default=0.0,
            )
            for each in types
        ]
        return -kept, is_risky, round(sum(way), 1)

    def next_part(self, kit: KitTask) -> tuple[Task, Sighting | tuple[TrackedBeltPart, float]] | None:
        """Return the next task of a kit and its part: one at rest, or one of a belt and the place along it [m].

        The belt comes first if it brings one in time, then what was lost on the tray, then the bins.
        """
        supply = self._supply
        for task in kit.open_tasks:
            meeting = supply.on_belt(task.type)
            if meeting is not None:
                return task, meeting
        self._view.look(*self._view.workplace.bin_areas, kit.station.area)
        lost = [part for part in strays(self._view, kit) if not is_known_faulty(kit, part)]
        in_bins = self._view.parts_in_bins()
        for lying in (lost, in_bins):
            found = [
                (task, part)
                for task in kit.open_tasks
                if (part := supply.best(task.type, lying, is_turned=task.is_turned)) is not None
            ]
            if found:
                return min(found, key=lambda each: self._part_cost(kit, in_bins, *each))
        return None

    def _part_cost(
        self, kit: KitTask, in_bins: Sequence[Sighting], task: Task, part: Sighting
    ) -> tuple[bool, bool, int, float]:
        """Return a key that is smaller for a part to fetch earlier, with the parts that lie in the bins.

        Those to be turned over come first, then those without another to spare: if one of these is dropped on the tray,
        it lies flat while the tray is empty. Then few failed attempts count, and the way.
        """
        wanted = sum(each.type == part.type for one in self._orders.open_kits() for each in one.open_tasks)
        lying = sum(each.type == part.type for each in in_bins)
        way = abs(self._worker.workplace.rail_beside(*part.world_T_part.position[:2]) - kit.station.rail)
        failures = self._supply.failures(part.world_T_part)
        return part.is_turned is task.is_turned, lying > wanted, failures, round(way, 1)

    def part_to_keep(self, kit: KitTask) -> tuple[TrayPlace, TrackedBeltPart, float] | None:
        """Return a part to keep on another tray while the last open kit waits: its station, the part, and its place.

        The place is along the belt [m].
        Only the belt brings it, perhaps once, and a later order may have it.
        """
        if self._orders.open_kits() != [kit]:
            return None
        others = [each for each in self._view.workplace.stations.values() if each is not kit.station]
        free = [each for each in others if self._view.is_ready(each.number)]
        if not free:
            return None
        supply = self._supply
        for part_type in supply.unordered(self._orders.kits):
            meeting = supply.on_belt(part_type, KEEPING_HORIZON)
            if meeting is not None:
                supply.kept.add(part_type)
                return free[0], *meeting
        return None
