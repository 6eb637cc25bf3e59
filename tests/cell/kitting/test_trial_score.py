import math

import pytest

from cellwright.cell.kitting.kit_score import score_kit
from cellwright.cell.kitting.scorer import Averages, OrderScore, system_cost, trial_score
from cellwright.config.sensors import SensorConfig, SensorType
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.cell.kitting.builders import full_tray, order

SECOND = 1_000_000_000


def sensors(*types: SensorType) -> list[SensorConfig]:
    return [SensorConfig(f"sensor_{number}", type_, Pose()) for number, type_ in enumerate(types)]


def earned(number: int, parts: int, time_taken: int) -> OrderScore:
    """Return an order that earned three points for each of its parts."""
    announced = order(number, ("gear_part",) * parts)
    return OrderScore(
        announced.order_id, (score_kit(announced.kits[0], full_tray(announced)),), time_taken, is_complete=True
    )


CAMERA = sensors("logical_camera")
AVERAGES = Averages(1000.0, (120.0, 60.0))


@pytest.mark.parametrize(
    ("types", "cost"),
    [
        ((), 0.0),
        (("break_beam",), 100.0),
        (("logical_camera", "logical_camera", "break_beam", "proximity_sensor", "laser_profiler"), 1300.0),
    ],
)
def test_system_cost_is_sum_over_sensors(types: tuple[SensorType, ...], cost: float) -> None:
    assert system_cost(sensors(*types)) == cost


def test_trial_score_of_two_orders_equals_hand_computation() -> None:
    score = trial_score(CAMERA, [earned(0, 4, 240 * SECOND), earned(1, 2, 30 * SECOND)], AVERAGES)
    assert (score.system_cost, score.cost_factor) == (500.0, 5.0)
    assert [share.completion for share in score.orders] == [12.0, 6.0]
    assert [share.efficiency for share in score.orders] == [0.5, 2.0]
    assert score.cost_points == 5.0 * (12 + 6) / 2
    assert score.total == 45.0 + 0.5 * 12 + 2.0 * 6 * 3


def test_missing_order_counts_as_order_without_points() -> None:
    one = trial_score(CAMERA, [earned(0, 4, 240 * SECOND)], AVERAGES)
    two = trial_score(CAMERA, [earned(0, 4, 240 * SECOND), OrderScore("order_1")], AVERAGES)
    assert one.total == two.total == 5.0 * 12 / 2 + 0.5 * 12


def test_cell_above_average_cost_loses_points() -> None:
    score = trial_score(sensors("logical_camera", "logical_camera"), [earned(0, 1, 60 * SECOND)], Averages(500, (60,)))
    assert score.cost_factor == -1.0
    assert score.total == -1.0 * 3 / 2 + 3.0


@pytest.mark.parametrize(
    ("cell", "orders", "averages", "message"),
    [
        ([], [earned(0, 1, SECOND)], AVERAGES, "without sensors"),
        (CAMERA, [earned(0, 1, 0)], AVERAGES, "earned 3.0 points in 0.0 s"),
        (CAMERA, [OrderScore("a"), OrderScore("b"), OrderScore("c")], AVERAGES, "at most 2 orders .got 3."),
        (CAMERA, [earned(0, 1, SECOND)], Averages(1000.0, ()), "an average time .got 1 orders and 0 times."),
        (CAMERA, [earned(0, 1, SECOND)], Averages(0.0, (1.0,)), "above 0 .got 0.0."),
        (CAMERA, [earned(0, 1, SECOND)], Averages(1000.0, (-1.0,)), "above 0 .got -1.0."),
        (CAMERA, [earned(0, 1, SECOND)], Averages(math.nan, (1.0,)), "above 0 .got nan."),
        (CAMERA, [earned(0, 1, SECOND)], Averages(1000.0, (math.inf,)), "above 0 .got inf."),
    ],
)
def test_trial_without_defined_score_is_refused(
    cell: list[SensorConfig], orders: list[OrderScore], averages: Averages, message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        trial_score(cell, orders, averages)
