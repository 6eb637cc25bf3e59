"""What to do next: the agent's behaviour as a state machine over its skills.

A state is a method that does one thing and returns the state that comes next. Skills tell whether they succeeded; what
follows from that is decided here.

    await_order -> choose_kit -> choose_part -> fetch | fetch_from_belt -> place -> check -> choose_part ...
                                             -> clean -> submit -> await_order
"""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Callable
from typing import Any, TypeAlias

from cellwright.agents.kitter.areas import BINS, bin_at
from cellwright.agents.kitter.arm import Arm
from cellwright.agents.kitter.belt_watch import BeltPart
from cellwright.agents.kitter.cellview import CellView
from cellwright.agents.kitter.eyes import Sighting
from cellwright.agents.kitter.kits import Kit, Task
from cellwright.agents.kitter.part_figures import PART_TYPES
from cellwright.agents.kitter.picking import Held, Picker, bin_rail
from cellwright.agents.kitter.placing import STATIONS, Placer, can_reach, pose_on_tray
from cellwright.agents.kitter.tray_plan import Place, find_place
from cellwright.client import Client
from cellwright.messages.build import pose_from_message
from cellwright.pose import Pose

log = logging.getLogger(__name__)

PATIENCE = 60.0
"""A part of which there is none in sight is waited for this long [s]."""

HURRY = 455.0
"""So long after the start [s] a kit is sent as it is: trials of the finals end after 500 s."""

ATTEMPTS = 4
"""How often a part in one place is tried."""

STRAY = 0.05
"""What lies further [m] from all that was put down does not belong on the tray."""

CLEANINGS = 4
"""How often something is taken off a tray before it is sent as it is."""

MISPLACED = 0.012
MISTURNED = 0.05
"""A part that lies further [m] or is turned more [rad] from where it was ordered is put right."""

FIRST_Y, LAST_Y, WAITING_Y = 1.7, -1.8, 1.55
"""Where parts are taken from the belt: world y [m] between the first two; the arm waits for them at the third."""


State: TypeAlias = "Callable[[], State | None]"


class Strategy:
    """The agent's behaviour in one run.

    Args:
        client: its hold on the cell.
        view: what it knows of the cell.
        arm: its arm.
        picker: how it takes hold of parts.
        placer: how it puts them down.
    """

    def __init__(self, client: Client, view: CellView, arm: Arm, picker: Picker, placer: Placer) -> None:
        self._client = client
        self._view = view
        self._arm = arm
        self._picker = picker
        self._placer = placer
        self._started = client.time
        self._kits: list[Kit] = []
        self._known_orders = 0
        self._kit: Kit | None = None
        self._task: Task | None = None
        self._held: Held | None = None
        self._place: Place | None = None
        self._target: Sighting | None = None
        self._belt_part: BeltPart | None = None
        self._meeting_y = FIRST_Y
        self._failures: Counter[tuple[int, int]] = Counter()
        self._last_progress = client.time
        self._cleanings = 0

    def run(self) -> None:
        """Work until there is nothing left to do."""
        state: State | None = self.await_order
        while state is not None:
            state = state()

    def _say(self, text: str, *arguments: Any) -> None:
        log.info("%.1f s: " + text, self._client.time, *arguments)

    # ---------------------------------------------------------------- orders and kits

    def await_order(self) -> State | None:
        """Wait until there is a kit to build; the end comes when the competition is over."""
        client = self._client
        client.wait_until(lambda: self._news() or client.competition_state in ("end_game", "done"))
        return self.choose_kit if self._open_kits() else None

    def _news(self) -> bool:
        """Take in new orders; whether there is a kit to build."""
        for order in self._client.orders[self._known_orders :]:
            self._known_orders += 1
            for kit in order.kits:
                tasks = [Task(each.type, pose_from_message(each.pose)) for each in kit.objects]
                self._kits.append(Kit(kit.kit_type, tasks))
                self._say("ordered: %s of %s", kit.kit_type, ", ".join(task.type for task in tasks))
        return bool(self._open_kits())

    def _open_kits(self) -> list[Kit]:
        return [kit for kit in self._kits if not kit.is_sent]

    def choose_kit(self) -> State | None:
        """The oldest kit that is not yet sent, at an AGV that is there."""
        kit = self._open_kits()[0]
        numbers = [number for number in STATIONS if self._view.agvs.is_ready(number)]
        if not numbers:
            self._client.wait_until(lambda: any(self._view.agvs.is_ready(number) for number in STATIONS), 60.0)
            numbers = [number for number in STATIONS if self._view.agvs.is_ready(number)] or [1]
        self._view.agvs.rest()
        kit.station = STATIONS[numbers[0]]
        self._kit = kit
        self._cleanings = 0
        self._last_progress = self._client.time
        self._say("building %s on AGV %d", kit.kit_type, kit.station.number)
        return self.choose_part

    # ---------------------------------------------------------------- parts

    def choose_part(self) -> State | None:
        """The next part to fetch, from the belt if one comes along, else from a bin; without any the kit is sent."""
        kit = self._current_kit
        self._news()
        open_tasks = [task for task in kit.tasks if task.is_open]
        for task in open_tasks:
            if task.type not in PART_TYPES:
                self._say("do not know how to handle a %s", task.type)
                task.given_up = True
        open_tasks = [task for task in open_tasks if task.is_open]
        if self._client.time - self._started > HURRY:
            return self.submit
        if not open_tasks:
            return self.clean
        for task in open_tasks:
            coming = self._coming(task.type)
            if coming is not None:
                self._task, (self._belt_part, self._meeting_y) = task, coming
                return self.fetch_from_belt
        self._view.look(BINS, kit.station.area)
        for lying in (self._strays(kit), self._view.parts_in_bins()):
            for task in open_tasks:
                target = self._best(task.type, lying)
                if target is not None:
                    self._task, self._target = task, target
                    return self.fetch
        if self._client.time - self._last_progress > PATIENCE:
            for task in open_tasks:
                self._say("no %s is to be had", task.type)
                task.given_up = True
            return self.choose_part
        return self.wait_by_belt

    def wait_by_belt(self) -> State | None:
        """Nothing is in reach: wait where the belt brings something, if it does, until it does."""
        kit = self._current_kit
        types = {task.type for task in kit.tasks if task.is_open}
        if any("belt" in self._client.material_locations(each) for each in types):
            self._say("waiting by the belt for %s", ", ".join(sorted(types)))
            hover = Pose.from_rpy((1.21, WAITING_Y, 1.0), (0.0, 0.0, 0.0))
            self._arm.travel(hover, WAITING_Y - 0.3)
            until = self._client.time + 15.0
            while self._client.time < until and not any(self._coming(each) for each in types):
                self._client.sleep(0.1)
        else:
            self._client.sleep(2.0)
        return self.choose_part

    def _coming(self, part_type: str) -> tuple[BeltPart, float] | None:
        """The first part of a type on the belt that can be met soon, and world y [m] where."""
        for part in self._view.belt.coming(part_type, self._client.time, LAST_Y):
            y = self._picker.meeting_place(part, FIRST_Y, LAST_Y)
            if y is not None and part.time_at(y) < self._client.time + 12.0:
                return part, y
        return None

    def _best(self, part_type: str, lying: list[Sighting]) -> Sighting | None:
        """The part to take: seldom tried, with much room around it, near the rail's place."""
        candidates = [
            part for part in lying if part.type == part_type and self._failures[spot(part.world_T_part)] < ATTEMPTS
        ]
        return min(
            candidates,
            key=lambda part: (
                self._failures[spot(part.world_T_part)],
                round(abs(part.world_T_part.position[1] - self._arm.rail), 1),
                -part.world_T_part.position[0],
            ),
            default=None,
        )

    def _strays(self, kit: Kit) -> list[Sighting]:
        """The parts on the tray that nobody put where they are, such as one that was lost over it."""
        return [
            part
            for part in self._view.parts_on_tray(kit.station.world_T_tray)
            if not any(near(part.world_T_part, pose_on_tray(kit.station, *lies), STRAY) for lies in kit.lying)
        ]

    def fetch(self) -> State | None:
        """Take the part that was chosen out of its bin, or from where it was lost on the tray."""
        task, target = self._current_task, self._target
        if target is None:
            return self.choose_part
        x, y, _ = target.world_T_part.position
        self._say("fetching a %s at (%.3f, %.3f)", task.type, x, y)
        where = spot(target.world_T_part)
        rail = bin_rail(y) if bin_at(x, y) is not None else self._current_kit.station.rail
        held = self._picker.from_rest(task.type, target.world_T_part, rail, attempt=self._failures[where])
        if held is None:
            self._failures[where] += 1
            self._say("no hold of it (%d)", self._failures[where])
            return self.choose_part
        self._held = held
        return self.place

    def fetch_from_belt(self) -> State | None:
        """Take the part that was chosen off the belt."""
        task, part = self._current_task, self._belt_part
        if part is None:
            return self.choose_part
        y = self._meeting_y
        self._say("taking a %s off the belt at y %.2f, at %.1f s", task.type, y, part.time_at(y))
        held = self._picker.from_belt(part, y)
        self._view.belt.forget(part)
        if held is None:
            self._say("it was missed")
            return self.choose_part
        self._held = held
        return self.place

    # ---------------------------------------------------------------- the tray

    def place(self) -> State | None:
        """Put the held part on the tray."""
        kit, task, held = self._current_kit, self._current_task, self._held
        self._held = None
        if held is None:
            return self.choose_part
        place = find_place(
            task.type,
            task.tray_T_goal,
            kit.taken(task),
            lambda pose: can_reach(self._arm, kit.station, held, pose),
        )
        if place is None:
            self._say("there is no room for a %s on the tray", task.type)
            task.given_up = True
            self._placer.throw_away(held)
            return self.choose_part
        x, y, _ = place.tray_T_part.position
        self._say("putting the %s at (%.3f, %.3f) of the tray, %s", task.type, x, y, place.distance_text)
        goal = pose_on_tray(kit.station, task.type, place.tray_T_part)
        if not self._placer.put_down(held, goal, kit.station.rail):
            self._say("it was lost on the way")
            self._client.control_gripper(False)
            return self.choose_part
        task.tray_T_part = place.tray_T_part
        self._place = place
        self._last_progress = self._client.time
        return self.check

    def check(self) -> State | None:
        """Look at what was put down: a faulty part is thrown away, one out of place is put right."""
        kit, task, place = self._current_kit, self._current_task, self._place
        station = kit.station
        if task.tray_T_part is None or place is None:
            return self.choose_part
        expected = pose_on_tray(station, task.type, task.tray_T_part)
        if any(near(pose, expected, 0.06) for pose in self._view.faulty_on_tray(station.number)):
            return self.reject
        if not self._view.sees(expected):
            return self.choose_part
        self._view.look(kit.station.area)
        seen = [part for part in self._view.parts_on_tray(station.world_T_tray) if part.type == task.type]
        found = min(seen, key=lambda part: gap(part.world_T_part, expected), default=None)
        if found is None or gap(found.world_T_part, expected) > 0.1:
            self._say("the %s is not on the tray", task.type)
            task.tray_T_part = None
            return self.choose_part
        offset = gap(found.world_T_part, expected)
        turn = abs(math.remainder(found.world_T_part.yaw - expected.yaw, 2 * math.pi))
        self._say("the %s lies %.1f mm and %.0f mrad from there", task.type, offset * 1e3, turn * 1e3)
        task.tray_T_part = station.world_T_tray.inverse() @ found.world_T_part
        if place.is_ordered and (offset > MISPLACED or turn > MISTURNED) and not task.corrected:
            task.corrected = True
            held = self._picker.from_rest(task.type, found.world_T_part, station.rail)
            if held is not None:
                self._held, task.tray_T_part = held, None
                return self.place
        return self.choose_part

    def reject(self) -> State | None:
        """Take a faulty part off the tray again."""
        kit, task = self._current_kit, self._current_task
        if task.tray_T_part is None:
            return self.choose_part
        self._say("the %s is faulty", task.type)
        where = pose_on_tray(kit.station, task.type, task.tray_T_part)
        lying = Pose((*where.position[:2], where.position[2] - 0.004), where.quaternion)
        task.tray_T_part = None
        for attempt in range(ATTEMPTS):
            held = self._picker.from_rest(task.type, lying, kit.station.rail, attempt=attempt)
            if held is not None:
                self._placer.throw_away(held)
                break
        return self.choose_part

    def clean(self) -> State | None:
        """Take what does not belong there off the tray; then send it."""
        kit = self._current_kit
        self._view.look(kit.station.area)
        strays = self._strays(kit)
        if not strays or self._cleanings >= CLEANINGS:
            return self.submit
        stray = strays[0]
        self._cleanings += 1
        self._say("there is a %s too many on the tray", stray.type)
        held = self._picker.from_rest(stray.type, stray.world_T_part, kit.station.rail, attempt=self._cleanings - 1)
        if held is not None:
            self._placer.throw_away(held)
        return self.clean

    def submit(self) -> State | None:
        """Send the kit off."""
        kit = self._current_kit
        self._view.agvs.listen()
        # the tray reports what lies on it once a second
        self._client.sleep(1.0)
        self._client.wait_until(lambda: self._view.agvs.is_ready(kit.station.number), 30.0)
        types = ", ".join(part_type for part_type, _ in kit.lying) or "nothing"
        self._say("sending AGV %d with %s: %s", kit.station.number, kit.kit_type, types)
        self._client.control_agv(kit.station.number, kit.kit_type)
        kit.is_sent = True
        self._client.sleep(1.0)
        return self.choose_kit if self._open_kits() else self.await_order

    # ---------------------------------------------------------------- inside

    @property
    def _current_kit(self) -> Kit:
        if self._kit is None:
            raise RuntimeError("no kit was chosen")
        return self._kit

    @property
    def _current_task(self) -> Task:
        if self._task is None:
            raise RuntimeError("no part was chosen")
        return self._task


def spot(world_T_part: Pose) -> tuple[int, int]:
    """A place in a bin, as a name for it: to 5 cm."""
    x, y, _ = world_T_part.position
    return round(x / 0.05), round(y / 0.05)


def gap(one: Pose, other: Pose) -> float:
    """Between two origins, height left out [m]."""
    return math.hypot(one.position[0] - other.position[0], one.position[1] - other.position[1])


def near(one: Pose, other: Pose, reach: float) -> bool:
    """Whether two origins are within `reach` [m], height left out."""
    return gap(one, other) < reach
