"""Scores of a game and of a trial: points and times of orders, carrying time, and the formula of the 2017 finals.

In the formula, CS is the points of an order, OT the time it took, and SC the cost of the sensors. AC and AT are the
averages of cost and times over all teams:

    CF = (AC / SC - 1) * 4 + 1        EF_i = AT_i / OT_i
    trial = CF * (CS_1 + CS_2) / 2 + EF_1 * CS_1 + 3 * EF_2 * CS_2

An order that a trial does not have, or that was never announced, earns nothing: its CS is 0.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cellwright.cell.kitting.inventory import TrayContents, contents_from_json, contents_to_json
from cellwright.cell.kitting.kit_score import KitScore, Refusal, RefusalReason, score_kit
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import Kit, Order
from cellwright.engine.clock import seconds
from cellwright.util.errors import UnknownNameError, UsageError

LOGICAL_CAMERA_COST = 500.0
"""Cost of a logical camera [$]."""
OTHER_SENSOR_COST = 100.0
"""Cost of any other sensor [$]."""
COST_WEIGHT = 4.0
"""Change of the cost factor when the average cost is twice as high."""
SECOND_ORDER_WEIGHT = 3.0
"""Weight of the second, more urgent order's efficiency."""
MAX_ORDERS = 2


class Stopwatch:
    """Stopwatch that adds up the time [ns] between `run` and `halt`."""

    def __init__(self) -> None:
        self._before = 0
        self._since: int | None = None

    def run(self, now: int) -> None:
        """Run from `now` [ns] on; no effect while it runs already."""
        if self._since is None:
            self._since = now

    def halt(self, now: int) -> None:
        """Stop at `now` [ns]."""
        self._before = self.elapsed(now)
        self._since = None

    def elapsed(self, now: int) -> int:
        """Return the running time until `now` [ns]."""
        return self._before if self._since is None else self._before + now - self._since

    def get_state(self) -> list[int | None]:
        """Return the time before the present run, and the start of that run, as JSON values."""
        return [self._before, self._since]

    def set_state(self, state: Sequence[int | None]) -> None:
        """Restore the state that `get_state` returned."""
        before, self._since = state
        self._before = before or 0


@dataclass(frozen=True, slots=True)
class OrderScore:
    """The score of an announced order.

    Attributes:
        kits: the scores of its kits, in the sequence of the order; zero for those not submitted yet.
        time_taken: from its announcement until it was complete, or until now [ns].
        is_complete: True if every kit of it was submitted, with any score.
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
    """The score of a whole game: of the orders announced so far, in that order.

    `part_travel_time` is how long the gripper was enabled and held something [ns].
    """

    orders: tuple[OrderScore, ...] = ()
    part_travel_time: int = 0

    @property
    def total(self) -> float:
        """All points of the game."""
        return sum(order.total for order in self.orders)


class _Announced:
    """State of an order since its announcement."""

    def __init__(self, order: Order) -> None:
        self.order = order
        self.clock = Stopwatch()
        self.judged: dict[str, tuple[TrayContents, KitScore]] = {}

    @property
    def is_complete(self) -> bool:
        return all(kit.kit_type in self.judged for kit in self.order.kits)

    def score(self, now: int) -> OrderScore:
        kits = tuple(
            self.judged[kit.kit_type][1] if kit.kit_type in self.judged else KitScore(kit.kit_type)
            for kit in self.order.kits
        )
        return OrderScore(self.order.order_id, kits, self.clock.elapsed(now), self.is_complete)


class Scorer:
    """Scorer of one game. Times `now` are in ns and never decrease.

    Orders in progress are a stack, as in the original: an announcement adds to its end, and a withdrawal takes away the
    end, whichever order it names. Points and clocks of an order are apart from it, and stay.

    Args:
        orders: the orders that may be announced.

    Raises:
        UsageError: two orders have the same id, or two kits the same type.
    """

    def __init__(self, orders: Iterable[Order]) -> None:
        self._orders: dict[str, Order] = {}
        self._kits: dict[str, tuple[Order, Kit]] = {}
        for order in orders:
            if order.order_id in self._orders:
                raise UsageError(f"order ids must be unique (got {order.order_id!r} twice)")
            self._orders[order.order_id] = order
            for kit in order.kits:
                if kit.kit_type in self._kits:
                    raise UsageError(f"kit types must be unique (got {kit.kit_type!r} twice)")
                self._kits[kit.kit_type] = (order, kit)
        self._announced: dict[str, _Announced] = {}
        self.in_progress: list[str] = []
        """Ids of the orders in progress, the newest last: only their kits are scored."""
        self._is_running = False
        self._is_carrying = False
        self._travel = Stopwatch()

    def begin(self, now: int) -> None:
        """Start the game: time counts from here."""
        self._is_running = True
        self._time_travel(now)

    def end(self, now: int) -> None:
        """End the game: all clocks stop."""
        self._is_running = False
        self._time_travel(now)
        for each in self._announced.values():
            each.clock.halt(now)

    def announce(self, order_id: str, now: int) -> None:
        """Announce an order: its clock runs, and its kits are scored from here.

        Raises:
            UsageError: it was announced before.
        """
        if order_id in self._announced:
            raise UsageError(f"an order is announced once (got {order_id!r} again)")
        announced = self._announced[order_id] = _Announced(self._orders[order_id])
        self.in_progress.append(order_id)
        if not announced.is_complete:
            announced.clock.run(now)

    def submit(self, kit_type: str, contents: TrayContents, now: int, station: str = "") -> KitScore:
        """Score the contents of a tray as a kit; `station` names its AGV or the fixed tray.

        The first submission of a kit counts; later ones return its score again. A kit that no order in progress asks
        for scores 0, and so does one of another tray than its own, with the reason in `refusal`.
        """
        order, kit = self._kits.get(kit_type, (None, None))
        if order is None or kit is None:
            return self._refuse(RefusalReason.UNKNOWN_KIT_TYPE, kit_type)
        announced = self._announced.get(order.order_id)
        if announced is None:
            return self._refuse(RefusalReason.NOT_ANNOUNCED, kit_type, order.order_id)
        if order.order_id not in self.in_progress:
            return self._refuse(RefusalReason.ORDER_CLOSED, kit_type, order.order_id)
        if kit.tray not in (None, station):
            return self._refuse(RefusalReason.OTHER_TRAY, kit_type, order.order_id)
        if kit_type not in announced.judged:
            announced.judged[kit_type] = (contents, score_kit(kit, contents))
            if announced.is_complete:
                announced.clock.halt(now)
        return announced.judged[kit_type][1]

    def withdraw(self, order_id: str, now: int) -> OrderScore:
        """Return the score of an order in progress, and take the newest one away, whichever that is.

        An order that is not in progress has a score of zero, and nothing is taken away. Points of the order that was
        taken away stay, its clock runs until it is complete, and its kits are scored no more.
        """
        if order_id not in self.in_progress:
            return OrderScore(order_id)
        self.in_progress.pop()
        return self.order_score(order_id, now)

    def gripper_changed(self, now: int, *, enabled: bool, attached: bool) -> None:
        """Update the carrying time after the gripper was switched, grasped a part or released it."""
        self._is_carrying = enabled and attached
        self._time_travel(now)

    def is_submitted(self, kit_type: str) -> bool:
        """Return True if a tray was judged as this kit."""
        return any(kit_type in each.judged for each in self._announced.values())

    def is_complete(self, order_id: str) -> bool:
        """Return True if an order was announced and every kit of it submitted."""
        return order_id in self._announced and self._announced[order_id].is_complete

    def order_score(self, order_id: str, now: int) -> OrderScore:
        """Return the score of an order; zero if it was not announced."""
        announced = self._announced.get(order_id)
        return OrderScore(order_id) if announced is None else announced.score(now)

    def game_score(self, now: int) -> GameScore:
        """Return the score of the game so far."""
        return GameScore(tuple(each.score(now) for each in self._announced.values()), self._travel.elapsed(now))

    def get_state(self) -> dict[str, Any]:
        """Return the state as JSON values. It has no scores: they follow from the judged trays."""
        return {
            "running": self._is_running,
            "carrying": self._is_carrying,
            "travel": self._travel.get_state(),
            "announced": [
                {
                    "order": order_id,
                    "withdrawn": order_id not in self.in_progress,
                    "clock": each.clock.get_state(),
                    "judged": {kit_type: contents_to_json(contents) for kit_type, (contents, _) in each.judged.items()},
                }
                for order_id, each in self._announced.items()
            ],
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore the state that `get_state` returned from a scorer with the same orders.

        Raises:
            UnknownNameError: it names an order or a kit that this scorer does not have.
        """
        announced: dict[str, _Announced] = {}
        for entry in state["announced"]:
            order_id = entry["order"]
            if order_id not in self._orders:
                raise UnknownNameError("order", order_id, self._orders)
            each = announced[order_id] = _Announced(self._orders[order_id])
            each.clock.set_state(entry["clock"])
            for kit_type, values in entry["judged"].items():
                if kit_type not in self._kits:
                    raise UnknownNameError("kit type", kit_type, self._kits)
                contents = contents_from_json(values)
                each.judged[kit_type] = (contents, score_kit(self._kits[kit_type][1], contents))
        self._announced = announced
        # Each order is announced once, so the stack has the sequence of the announcements.
        self.in_progress = [entry["order"] for entry in state["announced"] if not entry["withdrawn"]]
        self._is_running = state["running"]
        self._is_carrying = state["carrying"]
        self._travel.set_state(state["travel"])

    def _time_travel(self, now: int) -> None:
        if self._is_running and self._is_carrying:
            self._travel.run(now)
        else:
            self._travel.halt(now)

    def _refuse(self, reason: RefusalReason, kit_type: str, order_id: str | None = None) -> KitScore:
        accepted = tuple(kit.kit_type for order_id in self.in_progress for kit in self._orders[order_id].kits)
        return KitScore(kit_type, refusal=Refusal(reason, kit_type, order_id, accepted))


@dataclass(frozen=True, slots=True)
class Averages:
    """Averages over all teams in a trial: cost of the sensors, AC [$], and time for each order, AT [s]."""

    system_cost: float
    order_times: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class OrderShare:
    """Share of an order in a trial's score: its points, CS, in the time OT [s].

    The efficiency EF is 0 for an order that earned nothing; its time does not matter. `weight` is the factor of the
    efficiency term.
    """

    order_id: str
    completion: float
    time_taken: float
    efficiency: float
    weight: float

    @property
    def efficiency_points(self) -> float:
        """The weighted efficiency term of this order."""
        return self.efficiency * self.completion * self.weight


@dataclass(frozen=True, slots=True)
class TrialScore:
    """The score of a trial: cost of the sensors, SC [$], cost factor, CF, and a share of each order."""

    system_cost: float
    cost_factor: float
    orders: tuple[OrderShare, ...]

    @property
    def cost_points(self) -> float:
        """The cost term: the cost factor times half the points of the orders."""
        return self.cost_factor * sum(order.completion for order in self.orders) / MAX_ORDERS

    @property
    def total(self) -> float:
        """The score of the trial."""
        return self.cost_points + sum(order.efficiency_points for order in self.orders)


def system_cost(sensors: Iterable[SensorConfig]) -> float:
    """Return the total cost of the trial's sensors [$]; those that come with the AGVs are free."""
    return sum((LOGICAL_CAMERA_COST if each.type == "logical_camera" else OTHER_SENSOR_COST for each in sensors), 0.0)


def trial_score(sensors: Iterable[SensorConfig], orders: Sequence[OrderScore], averages: Averages) -> TrialScore:
    """Score a trial by the formula of the 2017 finals.

    Args:
        sensors: the trial's sensors.
        orders: scores of at most two orders, in the order of announcement.
        averages: averages over all teams.

    Raises:
        UsageError: the formula has no value. Causes are: no sensors, more than two orders, no average for an order,
            averages that are not positive numbers, or points earned in no time.
    """
    cost = system_cost(sensors)
    if cost == 0.0:
        raise UsageError("a trial without sensors has no score: the cost factor divides by their cost")
    if len(orders) > MAX_ORDERS:
        raise UsageError(f"a trial score covers at most {MAX_ORDERS} orders (got {len(orders)})")
    if len(averages.order_times) < len(orders):
        raise UsageError(
            f"each order needs an average time (got {len(orders)} orders and {len(averages.order_times)} times)"
        )
    for value in (averages.system_cost, *averages.order_times):
        if not 0.0 < value < math.inf:
            raise UsageError(f"an average must be finite and above 0 (got {value})")
    shares = tuple(
        _share(order, average, weight)
        for order, average, weight in zip(orders, averages.order_times, (1.0, SECOND_ORDER_WEIGHT), strict=False)
    )
    return TrialScore(cost, (averages.system_cost / cost - 1.0) * COST_WEIGHT + 1.0, shares)


def _share(order: OrderScore, average: float, weight: float) -> OrderShare:
    time_taken = seconds(order.time_taken)
    if order.total == 0.0:
        return OrderShare(order.order_id, 0.0, time_taken, 0.0, weight)
    if time_taken <= 0.0:
        raise UsageError(f"order {order.order_id!r} earned {order.total} points in {time_taken} s")
    return OrderShare(order.order_id, order.total, time_taken, average / time_taken, weight)
