"""Strategy of the kitter: a state machine that chooses the next part, fetches it, places it, and sends the kits.

A state is a method that does one thing and returns the next state, with its arguments bound. Skills return whether
they succeeded; the states decide what follows.

    await_order -> choose_part -> fetch | fetch_from_belt -> place -> check -> turn_over -> choose_part ...
                               -> clean -> keep -> submit -> await_order
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from functools import partial
from typing import Any, TypeAlias

from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.choice import Choice
from cellwright.clients.agents.kitter.crew import Worker
from cellwright.clients.agents.kitter.kits import (
    InspectionResult,
    KitTask,
    OrderBook,
    Task,
    TraySpot,
    find_place,
    find_turning_spot,
    inspect_part,
    is_near,
    strays,
)
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc
from cellwright.clients.agents.kitter.perception import Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.pick_and_place import Held, pose_on_tray
from cellwright.clients.agents.kitter.supply import ATTEMPTS
from cellwright.clients.agents.kitter.workplace import TrayPlace
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

BELT_TIMEOUT, LOST_TIMEOUT = 60.0, 5.0
"""Longest wait [s] for a part of which none is in sight: one that the belt may bring, or one that still rolls."""

LATEST_WORK_TIME = 455.0
"""Time after the start [s] at which a kit is sent as it is: trials of the finals end after 500 s."""

MAX_CLEANINGS = 4
"""Removals of parts from a tray before it is sent as it is."""

MAX_SENDINGS = 4
"""Requests to an AGV to go before its kit is given up."""

MAX_LOSSES = 5
"""Losses of a part on its way before it is given up."""

State: TypeAlias = "Callable[[], State | None]"

log = logging.getLogger(__name__)


class Strategy:
    """Behaviour of the agent in one run."""

    def __init__(self, client: Client, view: CellView, worker: Worker, catalogue: Catalogue) -> None:
        self._client = client
        self._view = view
        self._worker = worker
        self._hand, self._share = worker.hand, worker.share
        self._catalogue = catalogue
        places = worker.workplace
        self._orders = OrderBook(client, catalogue, (*places.stations.values(), *places.others), worker.share)
        self._choice = Choice(view, self._orders, worker)
        self._started = client.time
        self._last_progress = client.time

    def run(self) -> None:
        """Work until nothing is left to do."""
        state: State | None = self.await_order
        try:
            while state is not None:
                state = state()
        finally:
            self.report()

    def report(self) -> None:
        """Log the ordered parts that are missing, and why."""
        for (kit_type, part_type, reason), count in self._choice.missing().items():
            log.warning("%.1f s: not brought for %s: %d %s: %s", self._client.time, kit_type, count, part_type, reason)

    def _log(self, text: str, *arguments: Any) -> None:
        log.info("%.1f s: %s" + text, self._client.time, self._worker.title, *arguments)

    def _set_status(self, text: str, *arguments: Any) -> None:
        """Announce the next action, in the viewer too."""
        self._log(text, *arguments)
        self._client.set_status(self._worker.title + text % arguments)

    def await_order(self) -> State | None:
        """Wait until there is a kit to build; None when the competition is over."""
        self._client.set_status(self._worker.title + "waiting for an order")
        self._worker.arm.wait_until(lambda: bool(self._orders.open_kits()) or self._is_over())
        self._last_progress = self._client.time
        return self.choose_part if self._orders.open_kits() else None

    def await_agv(self) -> State | None:
        """Wait until an AGV or a tray is there; None when the competition is over."""
        if not self._worker.arm.wait_until(self._choice.has_station, 60.0):
            self._log("no AGV or tray is there")
            return None if self._is_over() else self.await_agv
        self._last_progress = self._client.time
        return self.choose_part

    def _is_workable(self, kit: KitTask) -> bool:
        """Return whether a kit has a station; it gets one now if one is there."""
        if not kit.is_begun and self._choice.give_station(kit):
            self._set_status("building %s on %s", kit.kit_type, kit.station.title)
        return kit.is_begun

    def submit(self, kit: KitTask) -> State | None:
        """Send the kit."""
        number = kit.station.number
        self._view.watch_stations(True)
        # the tray reports its contents once a second
        self._client.sleep(1.0)
        self._worker.arm.wait_until(lambda: self._view.is_ready(number), 30.0)
        types = ", ".join(part_type for part_type, _ in kit.lying) or "nothing"
        self._set_status("sending %s with %s: %s", kit.station.title, kit.kit_type, types)
        if kit.begun_at < math.inf:
            self._log("%s took %.1f s to build", kit.kit_type, self._client.time - kit.begun_at)
        kit.sendings += 1
        kit.is_sent = self._client.control_agv(kit.station.name, kit.kit_type) or kit.sendings >= MAX_SENDINGS
        if not kit.is_sent:
            self._log("it does not leave")
            return partial(self.submit, kit)
        self._share.end_kit(kit.kit_type)
        self._client.sleep(1.0)
        return self.choose_part if self._orders.open_kits() else self.await_order

    def _is_over(self) -> bool:
        return self._client.competition_state in ("end_game", "done")

    def choose_part(self) -> State | None:
        """Choose what to do next, for the kits of the newest order first; a later kit fills the wait for a part."""
        if self._share.has_news():
            self._view.note_change()
        kits = self._orders.open_kits()
        if not kits:
            return self.await_order
        kits = [kit for kit in kits if self._is_workable(kit)]
        if not kits:
            return self.await_agv
        is_late = self._client.time - self._started > LATEST_WORK_TIME
        for kit in kits:
            if is_late:
                return partial(self.submit, kit)
            if not kit.open_tasks:
                return partial(self.clean, kit)
            action = self._next_part(kit)
            if action is not None:
                kit.begun_at = min(kit.begun_at, self._client.time)
                return action
        waited = self._client.time - self._last_progress
        supply = self._worker.supply
        limits = ((task, BELT_TIMEOUT if supply.is_on_belt(task.type) else LOST_TIMEOUT) for task in kits[0].open_tasks)
        hopeless = [task for task, limit in limits if waited > limit]
        if hopeless:
            for task in hopeless:
                self._log("no %s is to be had", task.type)
                task.given_up = supply.why_none(task.type)
            return self.choose_part
        return partial(self.wait_by_belt, kits)

    def _next_part(self, kit: KitTask) -> State | None:
        """Return how to get the next part of a kit, first of all the one that the cup holds; None if there is none."""
        first = kit.open_tasks[0]
        if (held := self._hand.given(first.type)) is not None:
            return partial(self.place, kit, first, held)
        chosen = self._choice.next_part(kit)
        if chosen is None:
            return None
        task, found = chosen
        if isinstance(found, Sighting):
            return partial(self.fetch, kit, task, found)
        return partial(self.fetch_from_belt, kit, task, *found)

    def wait_by_belt(self, kits: list[KitTask]) -> State | None:
        """Wait for a part that the belt brings, when nothing else is in reach."""
        types = {task.type for kit in kits for task in kit.open_tasks}
        watched = next((each for each in self._view.belts if not types.isdisjoint(each.types)), None)
        if watched is not None:
            self._set_status("waiting by the belt for %s", ", ".join(sorted(types)))
            self._hand.await_belt(watched.belt)
            until = self._client.time + 15.0
            wanted = dict.fromkeys(task.type for kit in kits for task in kit.open_tasks)
            while self._client.time < until and not any(map(self._worker.supply.on_belt, wanted)):
                self._client.sleep(0.1)
                self._worker.arm.make_way()
        else:
            self._client.sleep(2.0)
            self._worker.arm.make_way()
        self._see_again(kits[0])
        return self.choose_part

    def fetch(self, kit: KitTask, task: Task, part: Sighting) -> State | None:
        """Take a part out of its bin, or from where it was lost on the tray."""
        x, y, _ = part.world_T_part.position
        self._set_status("fetching a %s at (%.3f, %.3f)", task.type, *self._view.workplace.in_world(x, y))
        hand, workplace, supply = self._hand, self._worker.workplace, self._worker.supply
        rail = workplace.rail_beside(x, y) if workplace.bin_at(x, y) else kit.station.rail
        attempt = supply.failures(part.world_T_part)
        self._share.take_part(part)
        lying, near = part.world_T_part, self._neighbours(kit, part)
        held = hand.from_rest(task.type, lying, rail, is_turned=part.is_turned, attempt=attempt, neighbours=near)
        self._share.end_part(is_taken=held is not None)
        self._view.note_change()
        if held is None:
            is_in_reach = hand.is_in_reach(task.type, part.world_T_part, rail)
            supply.note_failure(task.type, part.world_T_part, is_in_reach=is_in_reach)
            self._log("no hold of it (%d)" if is_in_reach else "it is out of reach (%d)", attempt + 1)
            return self.choose_part
        return partial(self.place, kit, task, held)

    def _neighbours(self, kit: KitTask, part: Sighting) -> list[Disc]:
        """Return the discs of other parts that were seen in bins and on the kit's tray, in the world."""
        seen = (*self._view.parts_in_bins(), *self._view.parts_on_tray(kit.station))
        others = [each for each in seen if each is not part and not is_near(each.world_T_part, part.world_T_part, 0.01)]
        return [disc for each in others for disc in self._catalogue.figures(each.type).covers(each.world_T_part)]

    def fetch_from_belt(self, kit: KitTask, task: Task, part: TrackedBeltPart, along: float) -> State | None:
        """Take a part from a belt at a place along it [m]."""
        place = self._view.workplace.in_world(*part.belt.point(along))
        self._set_status("taking a %s off the belt at (%.2f, %.2f), at %.1f s", task.type, *place, part.time_at(along))
        if not self._worker.arm.can_set_out(self._hand.departure(part, along), lambda: not self._share.is_free(part)):
            return self.choose_part
        self._share.take_part(part)
        held = self._hand.from_belt(part, along)
        self._share.end_part(is_taken=held is not None)
        self._view.forget(part)
        if held is None:
            self._log("it was missed")
            return self.choose_part
        return partial(self.place, kit, task, held)

    def place(self, kit: KitTask, task: Task, held: Held) -> State | None:
        """Put the held part on the tray."""
        station, hand, kind = kit.station, self._hand, self._catalogue.figures(task.type)
        is_reachable = self._reach(held, station)

        def can_turn_over(tray_T_part: Pose, direction: float) -> bool:
            lying = pose_on_tray(station, kind, tray_T_part, drop=0.0)
            return is_reachable(tray_T_part) and hand.can_turn_over(
                task.type, lying, station.world_T_tray.yaw + direction, station.rail
            )

        if held.is_turned == task.is_turned:
            place = find_place(kind, task.tray_T_goal, station.half, kit.taken(task), is_reachable)
        else:
            place = find_turning_spot(
                kind, task.tray_T_goal, station.half, kit.taken(task), kit.obstacles(task), can_turn_over
            )
        if place is None:
            self._log("there is no room for a %s on the tray", task.type)
            task.given_up = "no room on the tray"
            hand.throw_away(held)
            return self.choose_part
        x, y, _ = place.tray_T_part.position
        where = "as ordered" if place.is_ordered else "as near as there is room"
        where += "" if place.direction is None else ", to be turned over"
        self._set_status("putting the %s at (%.3f, %.3f) of the tray, %s", task.type, x, y, where)
        goal, see_again = pose_on_tray(station, kind, place.tray_T_part), partial(self._see_again, kit)
        if not hand.put_down(held, goal, station.rail, see_again):
            self._log("it was lost on the way")
            hand.let_go()
            self._see_again(kit)
            self._note_loss(task)
            return self.choose_part
        task.tray_T_part = place.tray_T_part
        self._last_progress = self._client.time
        return partial(self.check, kit, task, place)

    def _reach(self, held: Held, station: TrayPlace) -> Callable[[Pose], bool]:
        """Return a function that tells of a place on the tray whether the held part can be put down there."""
        hand, kind = self._hand, self._catalogue.figures(held.type)
        return lambda place: hand.can_put_down(held, pose_on_tray(station, kind, place), station.rail)

    def check(self, kit: KitTask, task: Task, place: TraySpot) -> State | None:
        """Check a placed part: throw a faulty one away, correct a misplaced one once."""
        is_turned = task.is_turned is (place.direction is None)
        finding = inspect_part(self._view, kit, task, place.tray_T_part, is_turned=is_turned)
        if finding.verdict is InspectionResult.FAULTY:
            return partial(self.reject, kit, task, place)
        if finding.verdict is InspectionResult.LOST:
            self._log("the %s is not on the tray", task.type)
            task.tray_T_part = None
            self._note_loss(task)
            return self.choose_part
        if place.direction is not None:
            return partial(self.turn_over, kit, task, place, place.direction, finding.world_T_part)
        if finding.world_T_part is None:
            return self.choose_part
        self._log("the %s lies %.1f mm and %.0f mrad from there", task.type, finding.offset * 1e3, finding.turn * 1e3)
        task.tray_T_part = kit.station.world_T_tray.inverse() @ finding.world_T_part
        if finding.verdict is InspectionResult.OUT_OF_PLACE and place.is_ordered and not task.corrected:
            task.corrected = True
            lying, rail = finding.world_T_part, kit.station.rail
            held = self._hand.from_rest(task.type, lying, rail, is_turned=task.is_turned)
            if held is not None:
                task.tray_T_part = None
                return partial(self.place, kit, task, held)
        return self.choose_part

    def turn_over(
        self, kit: KitTask, task: Task, place: TraySpot, direction: float, world_T_part: Pose | None
    ) -> State | None:
        """Turn a part over on the tray; then put it where it was ordered, if it is not there yet."""
        station, kind = kit.station, self._catalogue.figures(task.type)
        self._set_status("turning the %s over", task.type)
        lying = world_T_part or pose_on_tray(station, kind, place.tray_T_part, drop=0.0)
        task.tray_T_part = None
        direction += station.world_T_tray.yaw
        if not self._hand.turn_over(task.type, lying, direction, station.rail, partial(self._see_again, kit)):
            self._log("the cup did not hold its side")
            self._note_loss(task)
            return self.choose_part
        x, y, _ = place.tray_T_part.position
        after = TraySpot(Pose.from_rpy((x, y, 0.0), (0.0, 0.0, task.tray_T_goal.yaw)), place.is_ordered)
        if place.is_ordered:
            task.tray_T_part = after.tray_T_part
            return partial(self.check, kit, task, after)
        finding = inspect_part(self._view, kit, task, after.tray_T_part, is_turned=task.is_turned)
        lying = finding.world_T_part or pose_on_tray(station, kind, after.tray_T_part, drop=0.0)
        held = self._hand.from_rest(task.type, lying, station.rail, is_turned=task.is_turned)
        if held is None:
            self._note_loss(task)
            return self.choose_part
        return partial(self.place, kit, task, held)

    def _see_again(self, kit: KitTask) -> None:
        """Begin to look at the bins and the kit's tray, as something was moved."""
        self._view.note_change(*self._view.workplace.bin_areas, kit.station.area)

    def _note_loss(self, task: Task) -> None:
        """Count a part that did not reach the tray; a type that is lost repeatedly is given up."""
        task.losses += 1
        if task.losses >= MAX_LOSSES:
            task.given_up = f"it did not stay on the tray, {task.losses} times"

    def reject(self, kit: KitTask, task: Task, place: TraySpot) -> State | None:
        """Take a faulty part off the tray."""
        self._set_status("the %s is faulty: throwing it away", task.type)
        task.tray_T_part = None
        lying = pose_on_tray(kit.station, self._catalogue.figures(task.type), place.tray_T_part, drop=0.0)
        if not self._throw_away(kit, task.type, lying, ATTEMPTS):
            self._log("it stays where it is")
            kit.faulty.append((task.type, place.tray_T_part))
        return self.choose_part

    def clean(self, kit: KitTask) -> State | None:
        """Remove what does not belong on the tray, then send it."""
        self._view.look(kit.station.area)
        found = strays(self._view, kit)
        if not found or kit.cleanings >= MAX_CLEANINGS:
            kept = self._choice.part_to_keep(kit)
            return partial(self.submit, kit) if kept is None else partial(self.keep, kit, *kept)
        self._set_status("removing an extra %s from the tray", found[0].type)
        self._throw_away(kit, found[0].type, found[0].world_T_part, 1, kit.cleanings)
        kit.cleanings += 1
        return partial(self.clean, kit)

    def keep(self, kit: KitTask, station: TrayPlace, part: TrackedBeltPart, along: float) -> State | None:
        """Take a part off a belt, and lay it on another tray."""
        place = self._view.workplace.in_world(*part.belt.point(along))
        self._set_status("taking a %s off the belt at (%.2f, %.2f), to keep it on %s", part.type, *place, station.title)
        self._share.take_part(part)
        held = self._hand.from_belt(part, along)
        self._share.end_part(is_taken=held is not None)
        self._view.forget(part)
        if held is not None:
            kind = self._catalogue.figures(part.type)
            self._view.look(station.area)
            lying = self._view.parts_on_tray(station)
            poses = [(each.type, station.world_T_tray.inverse() @ each.world_T_part) for each in lying]
            others = [disc for name, pose in poses for disc in self._catalogue.figures(name).covers(pose)]
            spot = find_place(kind, Pose(), station.half, others, self._reach(held, station))
            if spot is None:
                self._hand.throw_away(held)
            elif not self._hand.put_down(held, pose_on_tray(station, kind, spot.tray_T_part), station.rail):
                self._hand.let_go()
            self._see_again(kit)
        return partial(self.clean, kit)

    def _throw_away(self, kit: KitTask, part_type: str, world_T_part: Pose, attempts: int, first: int = 0) -> bool:
        """Take a part off the tray and drop it on the floor; False if the cup did not hold it."""
        for attempt in range(first, first + attempts):
            held = self._hand.from_rest(part_type, world_T_part, kit.station.rail, attempt=attempt)
            self._see_again(kit)
            if held is not None:
                self._hand.throw_away(held)
                return True
        return False
