"""The kits that were ordered, in the order in which they are built."""

from __future__ import annotations

import logging

from cellwright.clients.agents.kitter.kits import Kit, Task
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client import Client
from cellwright.middleware.messages.build import pose_from_message
from cellwright.middleware.messages.osrf_gear import KitObject

log = logging.getLogger(__name__)


class OrderBook:
    """All kits that were ordered so far.

    Args:
        client: who hears of orders.
        catalogue: the part types that can be handled.
    """

    def __init__(self, client: Client, catalogue: Catalogue) -> None:
        self._client = client
        self._catalogue = catalogue
        self._kits: list[Kit] = []
        self._known = 0

    @property
    def kits(self) -> list[Kit]:
        """All kits that were ordered so far, those that were sent included."""
        return self._kits

    def open_kits(self) -> list[Kit]:
        """The kits that are not yet sent, the oldest first; new orders are taken in before."""
        for order in self._client.orders[self._known :]:
            self._known += 1
            for kit in order.kits:
                tasks = [self._task(each) for each in kit.objects]
                self._kits.append(Kit(kit.kit_type, tasks, self._catalogue))
                types = ", ".join(task.type for task in tasks)
                log.info("%.1f s: ordered: %s of %s", self._client.time, kit.kit_type, types)
                self._give_up_strangers(tasks)
        return [kit for kit in self._kits if not kit.is_sent]

    def _task(self, ordered: KitObject) -> Task:
        tray_T_goal = pose_from_message(ordered.pose)
        self._catalogue.note_order(ordered.type, tray_T_goal)
        return Task(ordered.type, self._catalogue.turned(ordered.type, tray_T_goal))

    def _give_up_strangers(self, tasks: list[Task]) -> None:
        for task in tasks:
            if task.type not in self._catalogue:
                task.given_up = self._catalogue.why_not(task.type)
                log.info("%.1f s: cannot handle a %s: %s", self._client.time, task.type, task.given_up)
