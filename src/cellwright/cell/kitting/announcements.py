"""Which order is announced next, and when."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from cellwright.cell.kitting.effects import AnnouncementReason
from cellwright.cell.kitting.tray import TrayContents
from cellwright.config.trial.trial import Order
from cellwright.engine.clock import nanoseconds
from cellwright.engine.events import NEVER
from cellwright.util.errors import UsageError

NOW = -NEVER
"""A time [ns] before any other: due at once."""


@dataclass(frozen=True, slots=True)
class Due:
    """When the next order is due [ns after the start], if nothing changes until then, and for what reason."""

    time: int
    reason: AnnouncementReason


class Announcements:
    """The orders of a trial, by start time, of which the first ones have been announced.

    Orders without a start time come after those with one; equals stay in the order of the file. Only the first of
    those that wait is looked at, so an order behind a conditional one waits for it.
    """

    def __init__(self, orders: Iterable[Order]) -> None:
        self.orders = tuple(
            sorted(orders, key=lambda order: math.inf if order.start_time is None else order.start_time)
        )
        self.announced = 0

    @property
    def waiting(self) -> tuple[Order, ...]:
        """The orders still to be announced, the next one first."""
        return self.orders[self.announced :]

    def due(self, trays: Iterable[TrayContents], *, idle: bool) -> Due | None:
        """When the next order is due with these trays; None when nothing but a change of them can bring it.

        Args:
            trays: the contents of every tray.
            idle: whether no order is in progress.
        """
        if self.announced == len(self.orders):
            return None
        order = self.orders[self.announced]
        if order.start_time is not None:
            return Due(min(nanoseconds(order.start_time), NEVER), AnnouncementReason.TIME)
        wanted_limit, unwanted_limit = order.wanted_parts or 0, order.unwanted_parts or 0
        if wanted_limit <= 0 and unwanted_limit <= 0:
            return None
        if idle:
            return Due(NOW, AnnouncementReason.IDLE)
        counts = [count_parts(order, contents) for contents in trays]
        if wanted_limit > 0 and any(wanted >= wanted_limit for wanted, _ in counts):
            return Due(NOW, AnnouncementReason.WANTED_PARTS)
        if unwanted_limit > 0 and any(unwanted >= unwanted_limit for _, unwanted in counts):
            return Due(NOW, AnnouncementReason.UNWANTED_PARTS)
        return None

    def announce(self) -> Order:
        """Take the next order as announced.

        Raises:
            UsageError: all orders have been announced.
        """
        if self.announced == len(self.orders):
            raise UsageError("all orders have been announced")
        self.announced += 1
        return self.orders[self.announced - 1]


def count_parts(order: Order, contents: TrayContents) -> tuple[int, int]:
    """How many good parts on a tray the order can use, and how many it can't.

    Each ordered part, over all kits of the order, can be served once. Faulty parts count on neither side.
    """
    ordered = Counter(each.type for kit in order.kits for each in kit.objects)
    good = Counter(each.type for each in contents if not each.is_faulty)
    wanted = (ordered & good).total()
    return wanted, good.total() - wanted
