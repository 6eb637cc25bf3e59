"""The score of a trial: what the orders earned, weighed with the cost of the sensors and with the time it took.

The formula of the 2017 finals, with CS the points of an order, OT the time it took, SC the cost of the sensors, and AC
and AT the averages of cost and times over all teams:

    CF = (AC / SC - 1) * 4 + 1        EF_i = AT_i / OT_i
    trial = CF * (CS_1 + CS_2) / 2 + EF_1 * CS_1 + 3 * EF_2 * CS_2

An order that a trial does not have, or that was never announced, earns nothing: its CS is 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cellwright.cell.kitting.score.scorer import OrderScore
from cellwright.config.trial.trial import Sensor
from cellwright.engine.clock import seconds
from cellwright.util.errors import UsageError

LOGICAL_CAMERA_COST = 500.0
"""What a logical camera costs [$]."""
OTHER_SENSOR_COST = 100.0
"""What any other sensor costs [$]."""
COST_WEIGHT = 4.0
"""How much the cost factor changes when the average costs twice as much."""
SECOND_ORDER_WEIGHT = 3.0
"""How much more the efficiency of the second, more urgent order counts."""
MOST_ORDERS = 2


@dataclass(frozen=True, slots=True)
class Averages:
    """What all teams spent on a trial, on average.

    Attributes:
        system_cost: cost of the sensors, AC [$].
        order_times: time taken for each order, AT [s].
    """

    system_cost: float
    order_times: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class OrderShare:
    """What an order adds to a trial's score.

    Attributes:
        order_id: which order.
        completion: its points, CS.
        time_taken: OT [s].
        efficiency: EF; 0 for an order that earned nothing, whose time does not matter.
        weight: how much its efficiency counts.
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
    """The score of a trial and what it is made of.

    Attributes:
        system_cost: cost of the sensors, SC [$].
        cost_factor: CF.
        orders: the share of each order.
    """

    system_cost: float
    cost_factor: float
    orders: tuple[OrderShare, ...]

    @property
    def cost_points(self) -> float:
        """The cost term: the cost factor times half the points of the orders."""
        return self.cost_factor * sum(order.completion for order in self.orders) / MOST_ORDERS

    @property
    def total(self) -> float:
        """The score of the trial."""
        return self.cost_points + sum(order.efficiency_points for order in self.orders)


def system_cost(sensors: Iterable[Sensor]) -> float:
    """What the sensors somebody put into the cell cost [$]; those that come with the AGVs are free."""
    return sum((LOGICAL_CAMERA_COST if each.type == "logical_camera" else OTHER_SENSOR_COST for each in sensors), 0.0)


def trial_score(sensors: Iterable[Sensor], orders: Sequence[OrderScore], averages: Averages) -> TrialScore:
    """Score a trial.

    Args:
        sensors: the sensors of the trial.
        orders: the scores of its orders, in the order of announcement.
        averages: what all teams spent on this trial.

    Raises:
        UsageError: the formula has no value: no sensors, more than two orders, no average for an order, averages that
            are not positive numbers, or points earned in no time.
    """
    cost = system_cost(sensors)
    if cost == 0.0:
        raise UsageError("a trial without sensors has no score: the cost factor divides by their cost")
    if len(orders) > MOST_ORDERS:
        raise UsageError(f"a trial is scored with at most {MOST_ORDERS} orders, not {len(orders)}")
    if len(averages.order_times) < len(orders):
        raise UsageError(f"{len(orders)} orders need as many average times, not {len(averages.order_times)}")
    for value in (averages.system_cost, *averages.order_times):
        if not 0.0 < value < math.inf:
            raise UsageError(f"an average must be a number above 0, not {value}")
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
