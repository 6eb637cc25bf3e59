"""Orders in short: kits, trays, announcements, and refusals."""

import pytest

from cellwright.config.trial.gear2017 import load_trial, resolved
from cellwright.config.trial.trial import Order
from cellwright.util.errors import DescriptionError


def orders(text: str) -> tuple[Order, ...]:
    """Return the orders of a trial with the trays `left` and `right`."""
    cell = "cell: {trays: {left: {at: [1, 0], size: [0.4, 0.6]}, right: {at: [1, 1]}}}\n"
    return load_trial(text=f"{cell}orders: {text}").trial.orders


def test_order_of_parts_is_a_kit_for_its_tray() -> None:
    (order,) = orders("{order_0: {tray: left, parts: [{type: gear_part, xy: [0.1, -0.2], yaw: 1}, {type: disk_part}]}}")
    (kit,) = order.kits
    assert (order.order_id, order.start_time, kit.kit_type, kit.tray) == ("order_0", 0.0, "order_0_kit_0", "left")
    assert [(each.type, each.pose.position) for each in kit.objects] == [
        ("gear_part", (0.1, -0.2, 0.0)),
        ("disk_part", (0.0, 0.0, 0.0)),
    ]
    assert kit.objects[0].pose.yaw == pytest.approx(1.0)


def test_order_of_kits_has_a_tray_for_each() -> None:
    part = "parts: [{type: gear_part}]"
    (order,) = orders(
        f"{{order_0: {{after: 20, kits: [{{tray: left, {part}}}, {{tray: right, {part}}}, {{{part}}}]}}}}"
    )
    assert [(kit.kit_type, kit.tray) for kit in order.kits] == [
        ("order_0_kit_0", "left"),
        ("order_0_kit_1", "right"),
        ("order_0_kit_2", None),
    ]
    assert order.start_time == 20.0


def test_both_forms_stand_side_by_side() -> None:
    old = "{announcement_condition: time, announcement_condition_value: 5, parts: {a: {type: gear_part, pose: {}}}}"
    loaded = load_trial(text=f"orders: {{order_1: {old}, order_0: {{tray: agv1, parts: [{{type: gear_part}}]}}}}")
    assert [each.kits[0].tray for each in loaded.trial.orders] == ["agv1", None]
    assert [each["announcement_condition_value"] for each in resolved(loaded)["orders"]] == [0.0, 5]


@pytest.mark.parametrize(
    ("order", "reason"),
    [
        ("{tray: left}", "order_0: write parts or kits, and one of them"),
        ("{kits: [], parts: []}", "order_0: write parts or kits, and one of them"),
        ("{tray: lefd, parts: [{type: gear_part}]}", "tray: the cell has no AGV or tray 'lefd'; did you mean left"),
        (
            "{tray: left, kits: [{parts: [{type: gear_part}]}]}",
            "tray: belongs into the kits, each of which has its own",
        ),
        ("{parts: []}", "parts: must be a list of 1 to 2000 mappings (got a list of 0)"),
        ("{kits: []}", "kits: must be a list of 1 to 2000 mappings (got a list of 0)"),
        ("{kits: [{tray: left}]}", "kits[0]: the required entry 'parts' is missing"),
        ("{parts: [{type: gear_prat}]}", "parts[0].type: unknown part type 'gear_prat'; did you mean gear_part"),
        ("{parts: [{xy: [0, 0]}]}", "parts[0]: the required entry 'type' is missing"),
        ("{parts: [{type: gear_part, xz: 1}]}", "parts[0].xz: unknown entry"),
        ("{tray: left, parts: [{type: gear_part, xy: [0.18, 0]}]}", "over the edge of the tray by 19 mm"),
        ("{parts: [{type: gear_part, xy: [0.3, 0]}]}", "over the edge of the tray by 89 mm"),
        ("{tray: left, parts: [{type: gear_part}], after: -1}", "after: must be from 0 to 1e+06 s (got -1)"),
        ("{tray: left, part: [{type: gear_part}]}", "part: unknown entry; did you mean parts"),
    ],
)
def test_mistake_is_refused_with_its_line(order: str, reason: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        orders(f"{{order_0: {order}}}")
    assert any(
        str(each).startswith("<text>:2: orders.order_0") and reason in str(each) for each in caught.value.problems
    )


def test_part_may_lie_on_the_larger_tray_if_the_kit_names_none() -> None:
    assert orders("{order_0: {parts: [{type: gear_part, xy: [0.2, 0]}]}}")[0].kits[0].tray is None
