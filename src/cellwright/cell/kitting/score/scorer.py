"""The score of a game: orders, their kits, the time they took, and how long parts were carried."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from cellwright.cell.kitting.score.kit_score import KitScore, Refusal, RefusalReason
from cellwright.cell.kitting.score.matching import score_kit
from cellwright.cell.kitting.stopwatch import Stopwatch
from cellwright.cell.kitting.tray import TrayContents, contents_from_json, contents_to_json
from cellwright.config.trial.trial import Kit, Order
from cellwright.util.errors import UnknownNameError, UsageError


@dataclass(frozen=True, slots=True)
class OrderScore:
    """The score of one order that was announced.

    Attributes:
        order_id: which order.
        kits: the scores of its kits in the order of the order; zero for those not submitted yet.
        time_taken: from its announcement until it was complete, or until now [ns].
        is_complete: whether every kit of it was submitted, whatever it scored.
    """

    order_id: str
    kits: tuple[KitScore, ...] = ()
    time_taken: int = 0
    is_complete: bool = False

    @property
    def total(self) -> float:
        """All points of this order."""
        return sum(kit.total for kit in self.kits)


@dataclass(frozen=True, slots=True)
class GameScore:
    """The score of a whole game.

    Attributes:
        orders: the orders announced so far, in that order.
        part_travel_time: how long the gripper was enabled and held something [ns].
    """

    orders: tuple[OrderScore, ...] = ()
    part_travel_time: int = 0

    @property
    def total(self) -> float:
        """All points of the game."""
        return sum(order.total for order in self.orders)


class _Announced:
    """An order since its announcement."""

    def __init__(self, order: Order) -> None:
        self.order = order
        self.is_withdrawn = False
        self.clock = Stopwatch()
        self.judged: dict[str, tuple[TrayContents, KitScore]] = {}

    @property
    def is_complete(self) -> bool:
        return all(kit.kit_type in self.judged for kit in self.order.kits)

    @property
    def is_closed(self) -> bool:
        return self.is_withdrawn and self.is_complete

    def score(self, now: int) -> OrderScore:
        kits = tuple(
            self.judged[kit.kit_type][1] if kit.kit_type in self.judged else KitScore(kit.kit_type)
            for kit in self.order.kits
        )
        return OrderScore(self.order.order_id, kits, self.clock.elapsed(now), self.is_complete)


class Scorer:
    """Keeps the score of one game. All times `now` are in ns and never run backwards.

    Args:
        orders: every order that may be announced.

    Raises:
        UsageError: two orders of one id, or two kits of one type.
    """

    def __init__(self, orders: Iterable[Order]) -> None:
        self._orders: dict[str, Order] = {}
        self._kits: dict[str, tuple[Order, Kit]] = {}
        for order in orders:
            if order.order_id in self._orders:
                raise UsageError(f"there are two orders {order.order_id!r}")
            self._orders[order.order_id] = order
            for kit in order.kits:
                if kit.kit_type in self._kits:
                    raise UsageError(f"there are two kits {kit.kit_type!r}")
                self._kits[kit.kit_type] = (order, kit)
        self._announced: dict[str, _Announced] = {}
        self._is_running = False
        self._is_carrying = False
        self._travel = Stopwatch()

    def begin(self, now: int) -> None:
        """The game begins: time counts from here."""
        self._is_running = True
        self._time_travel(now)

    def end(self, now: int) -> None:
        """The game is over: all clocks stand still."""
        self._is_running = False
        self._time_travel(now)
        for each in self._announced.values():
            each.clock.halt(now)

    def announce(self, order_id: str, now: int) -> None:
        """An order is announced: its clock runs, and its kits are scored from here.

        Raises:
            UnknownNameError: there is no such order.
            UsageError: it was announced before, or the game is not running.
        """
        if order_id not in self._orders:
            raise UnknownNameError("order", order_id, self._orders)
        if order_id in self._announced:
            raise UsageError(f"order {order_id!r} was announced already")
        if not self._is_running:
            raise UsageError(f"order {order_id!r} was announced while no game is running")
        announced = self._announced[order_id] = _Announced(self._orders[order_id])
        if not announced.is_complete:
            announced.clock.run(now)

    def submit(self, kit_type: str, contents: TrayContents, now: int) -> KitScore:
        """Score a tray as a kit.

        The first submission of a kit counts; later ones return its score again. A kit that no order in progress asks
        for scores 0 and says why in `refusal`.
        """
        order, kit = self._kits.get(kit_type, (None, None))
        if order is None or kit is None:
            return self._refuse(RefusalReason.UNKNOWN_KIT_TYPE, kit_type)
        announced = self._announced.get(order.order_id)
        if announced is None:
            return self._refuse(RefusalReason.NOT_ANNOUNCED, kit_type, order.order_id)
        if announced.is_closed:
            return self._refuse(RefusalReason.ORDER_CLOSED, kit_type, order.order_id)
        if kit_type not in announced.judged:
            announced.judged[kit_type] = (contents, score_kit(kit, contents))
            if announced.is_complete:
                announced.clock.halt(now)
        return announced.judged[kit_type][1]

    def withdraw(self, order_id: str, now: int) -> OrderScore:
        """Take an order back; what it has earned stays, and once it is complete no kit of it is scored any more.

        Of one that is not complete the clock runs on from its announcement, and a kit that is submitted later is scored
        in full, as in the original.
        """
        if order_id in self._announced:
            self._announced[order_id].is_withdrawn = True
        return self.order_score(order_id, now)

    def gripper_changed(self, now: int, *, enabled: bool, attached: bool) -> None:
        """The gripper was switched, took something or let go of it."""
        self._is_carrying = enabled and attached
        self._time_travel(now)

    def is_submitted(self, kit_type: str) -> bool:
        """Whether a tray was judged as this kit."""
        return any(kit_type in each.judged for each in self._announced.values())

    def is_complete(self, order_id: str) -> bool:
        """Whether an order was announced and every kit of it submitted."""
        return order_id in self._announced and self._announced[order_id].is_complete

    def order_score(self, order_id: str, now: int) -> OrderScore:
        """The score of an order; zero for one that was not announced."""
        announced = self._announced.get(order_id)
        return OrderScore(order_id) if announced is None else announced.score(now)

    def game_score(self, now: int) -> GameScore:
        """The score of the game so far."""
        return GameScore(tuple(each.score(now) for each in self._announced.values()), self._travel.elapsed(now))

    def get_state(self) -> dict[str, Any]:
        """All that the scorer remembers, as JSON values. Scores are not kept: they follow from the trays judged."""
        return {
            "running": self._is_running,
            "carrying": self._is_carrying,
            "travel": self._travel.get_state(),
            "announced": [
                {
                    "order": order_id,
                    "withdrawn": each.is_withdrawn,
                    "clock": each.clock.get_state(),
                    "judged": {kit_type: contents_to_json(contents) for kit_type, (contents, _) in each.judged.items()},
                }
                for order_id, each in self._announced.items()
            ],
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` of a scorer with the same orders returned.

        Raises:
            UnknownNameError: it speaks of an order or a kit that is not known here.
        """
        announced: dict[str, _Announced] = {}
        for entry in state["announced"]:
            order_id = entry["order"]
            if order_id not in self._orders:
                raise UnknownNameError("order", order_id, self._orders)
            each = announced[order_id] = _Announced(self._orders[order_id])
            each.is_withdrawn = entry["withdrawn"]
            each.clock.set_state(entry["clock"])
            for kit_type, values in entry["judged"].items():
                if kit_type not in self._kits:
                    raise UnknownNameError("kit type", kit_type, self._kits)
                contents = contents_from_json(values)
                each.judged[kit_type] = (contents, score_kit(self._kits[kit_type][1], contents))
        self._announced = announced
        self._is_running = state["running"]
        self._is_carrying = state["carrying"]
        self._travel.set_state(state["travel"])

    def _time_travel(self, now: int) -> None:
        if self._is_running and self._is_carrying:
            self._travel.run(now)
        else:
            self._travel.halt(now)

    def _refuse(self, reason: RefusalReason, kit_type: str, order_id: str | None = None) -> KitScore:
        wanted = tuple(
            kit.kit_type for each in self._announced.values() if not each.is_closed for kit in each.order.kits
        )
        return KitScore(kit_type, refusal=Refusal(reason, kit_type, order_id, wanted))
