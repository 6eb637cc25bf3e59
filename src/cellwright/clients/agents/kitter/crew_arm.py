"""One of several arms that work at once: it waits while others are in its way, and makes way for them."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Sequence

from cellwright.clients.agents.kitter.arm import NONE, RISING, Errand, KitterArm
from cellwright.clients.agents.kitter.clearance import Clearance, Obstacle
from cellwright.clients.agents.kitter.motion import at_height, facing_down, straight_path
from cellwright.clients.agents.kitter.part_figures import PartFigures
from cellwright.clients.agents.kitter.postures import Postures
from cellwright.clients.agents.kitter.regions import Lane
from cellwright.clients.client import Client
from cellwright.clients.client.arm import ClientArm
from cellwright.motion.solver import Vector

MAX_WAIT = 30.0
"""Longest wait [s] for other arms to leave the way."""

RETRY = 0.5
"""Time [s] after which an arm tries again to make way."""

log = logging.getLogger(__name__)


class _WayTakenError(Exception):
    """Another arm is in the way."""


class CrewArm(KitterArm):
    """An arm among others; `lane` is its region among theirs.

    A way is taken at once with all that the tool does at its end: an arm that has come to a part can take it, and draw
    back. So it waits only where it can make way.

    Raises:
        UsageError: no joint states arrive within a second.
    """

    is_alone = False

    def __init__(
        self, client: Client, device: ClientArm, postures: Postures, clearance: Clearance, highest: float, lane: Lane
    ) -> None:
        super().__init__(client, device, postures, clearance, highest)
        self._lane = lane

    def fault_at_home(self) -> Obstacle | None:
        """Return what it is too near to at home; None if it is near nothing."""
        return self._obstacle([self._figures.home])

    def make_way(self) -> None:
        """Go home if another arm waits until this one leaves where it is."""
        if self._lane.is_in_the_way and not self._go_home():
            self._client.sleep(RETRY)

    def can_set_out(self, time: float, is_in_vain: Callable[[], bool]) -> bool:
        """Wait for the time [s] at which it has to set out; False if it is in vain by then."""
        self.wait_until(lambda: self._client.time >= time or is_in_vain())
        return not is_in_vain()

    def wait_until(self, condition: Callable[[], bool], timeout: float | None = None) -> bool:
        """Wait as `Client.wait_until`, and make way for other arms meanwhile."""
        end = math.inf if timeout is None else self._client.time + timeout
        while not condition() and self._client.time < end:
            self._client.wait_until(lambda: condition() or self._lane.is_in_the_way, end - self._client.time)
            self.make_way()
        return condition()

    def rise(self, height: float) -> None:
        """Rise straight up until the gripper link is at a height [m]; then nothing is left to do where it was."""
        super().rise(height)
        self._lane.keep([self._commanded], self._load_kind)

    def _rise_first(self, height: float) -> None:
        """Rise at the beginning of a way; raises a `_WayTakenError` if another arm is in the way."""
        start = self.tool
        if start.position[2] < height:
            up = straight_path(start, facing_down(at_height(start, height)), RISING)
            self._enter([self._commanded, *self._joints_along((pose for _, pose in up), self._commanded)], NONE)
        self.rise(height)

    def _go_home(self) -> bool:
        """Move to where it began; False if something is in the way."""
        try:
            self._rise_first(self.safe)
            ways = self.postures.ways(self._commanded, self._figures.home, self._extra)
            is_home = any(self._move_on(stops, NONE) for stops in ways)
        except _WayTakenError:
            return False
        if is_home:
            self._lane.leave()
        return is_home

    def _go(self, ways: Callable[[], Iterable[Sequence[Vector]]], errand: Errand) -> bool:
        """Move along the first of some ways that has nothing of the cell in it, once no other arm is; False if none is.

        `ways` returns them from where the arm is: it may have to make way for another one.
        """
        end = min(errand.until, self._client.time + MAX_WAIT)
        while True:
            try:
                return any(self._move_on(stops, errand) for stops in ways())
            except _WayTakenError as taken:
                if self._client.time >= end:
                    log.info("%.1f s: not moved: %s", self._client.time, taken)
                    return False
            self._lane.wait(self._client, end - self._client.time)
            self.make_way()

    def _move_on(self, stops: Sequence[Vector], errand: Errand) -> bool:
        """Move as `_move`; raises a `_WayTakenError` if another arm is in the way, or in that of the errand."""
        positions = self.postures.motion(self._commanded, stops).positions
        if self._is_blocked(positions, touches=False):
            return False
        last = tuple(positions[-1])
        after = [last, *self._joints_along(errand.poses, last)]
        self._enter([*positions, *after], errand)
        is_moved = self._move(*stops)
        self._lane.keep(after, errand.load or self._load_kind)
        return is_moved

    def _enter(self, path: Sequence[Sequence[float]], errand: Errand) -> None:
        """Keep other arms away from a path; raises a `_WayTakenError` if one of them is there."""
        obstacle = self._lane.enter(path, errand.load or self._load_kind)
        if obstacle is not None:
            raise _WayTakenError(obstacle)

    @property
    def _load_kind(self) -> PartFigures | None:
        return None if self.load is None else self.load.kind
