"""Orders: kits, conditions of their announcement, and ids."""

import pytest

from cellwright.config.trial.orders import CONDITIONS
from tests.config.trial.texts import ORDER, PART, conditional, trial, warnings


def test_orders_have_kits_conditions_and_ids() -> None:
    text = f"""
orders:
  order_0: {{{ORDER}, kit_count: 2, parts: {{a: {PART}}}}}
  order_1: {{announcement_condition: wanted_parts, announcement_condition_value: '2', parts: {{a: {PART}}}}}
  order_2: {{announcement_condition: unwanted_parts, announcement_condition_value: 1, parts: {{a: {PART}}}}}
"""
    two, zero, one = trial(text).orders
    assert [kit.kit_type for kit in zero.kits] == ["order_0_kit_0", "order_0_kit_1"]
    assert (one.start_time, one.wanted_parts, one.unwanted_parts) == (None, 2, None)
    assert (two.order_id, two.yaml_name, two.unwanted_parts) == ("order_0", "order_2", 1)
    # Python 2 iterated over order_2 first, so its kits are called after order_2 and its id is order_0.
    assert [message.split(" ")[0] for message in warnings(text)] == ["3:", "4:", "5:"]
    assert "orders.order_2: its id is order_0" in warnings(text)[2]


def test_order_with_unfulfillable_condition_has_none() -> None:
    for condition, value in (("soon", 1), ("wanted_parts", 0)):
        (order,) = trial(conditional(condition, value)).orders
        assert (order.start_time, order.wanted_parts, order.unwanted_parts) == (None, None, None)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_each_condition_sets_one_field(condition: str) -> None:
    (order,) = trial(conditional(condition, 3)).orders
    assert sorted((order.start_time, order.wanted_parts, order.unwanted_parts), key=str) == [3, None, None]
