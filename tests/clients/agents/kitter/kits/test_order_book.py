"""Orders as kits to build."""

import math
from types import SimpleNamespace
from typing import cast

import pytest

from cellwright.clients.agents.kitter.agreement import Agreement
from cellwright.clients.agents.kitter.kits import OrderBook
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client import Client
from cellwright.middleware.messages.conversions import pose_message
from cellwright.middleware.messages.osrf_gear import Kit, KitObject, Order
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import STATIONS


def order(name: str, *types: str) -> Order:
    return Order(name, [Kit(f"{name}_kit_0", [KitObject(each, pose_message(Pose((0.1, 0.2, 0.0)))) for each in types])])


def fake_client(*orders: Order, locations: tuple[str, ...] = ()) -> SimpleNamespace:
    return SimpleNamespace(orders=list(orders), time=0.0, material_locations=lambda _kit: locations)


def test_open_kits_of_newest_order_come_first() -> None:
    client = fake_client(order("order_0", "gear_part"))
    book = OrderBook(cast("Client", client), Catalogue(), tuple(STATIONS.values()), Agreement().share())
    (first,) = book.open_kits()
    assert [(task.type, task.tray_T_goal.position) for task in first.tasks] == [("gear_part", (0.1, 0.2, 0.0))]
    client.orders.append(order("order_1", "disk_part"))
    assert [kit.kit_type for kit in book.open_kits()] == ["order_1_kit_0", "order_0_kit_0"]
    assert [kit.kit_type for kit in book.kits] == ["order_0_kit_0", "order_1_kit_0"]
    first.is_sent = True
    assert [kit.kit_type for kit in book.open_kits()] == ["order_1_kit_0"]


def test_part_of_unknown_type_has_no_open_task() -> None:
    client = SimpleNamespace(
        material_locations=lambda _kit: (), orders=[order("order_0", "u_joint_part", "gear_part")], time=0.0
    )
    (kit,) = OrderBook(cast("Client", client), Catalogue(), tuple(STATIONS.values()), Agreement().share()).open_kits()
    assert [task.type for task in kit.open_tasks] == ["gear_part"]


def test_ordered_side_is_that_of_task() -> None:
    below = Pose.from_rpy((0.1, 0.2, 0.0), (math.pi, 0.0, 0.5))
    objects = [KitObject(name, pose_message(below)) for name in ("pulley_part", "gear_part")]
    client = SimpleNamespace(
        material_locations=lambda _kit: (), orders=[Order("order_0", [Kit("kit", objects)])], time=0.0
    )
    (kit,) = OrderBook(cast("Client", client), Catalogue(), tuple(STATIONS.values()), Agreement().share()).open_kits()
    pulley, gear = kit.tasks
    assert (pulley.is_turned, gear.is_turned) == (True, False)
    assert pulley.tray_T_goal.rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert pulley.tray_T_goal.position[:2] == pytest.approx((0.1, 0.2))


@pytest.mark.parametrize(
    ("locations", "allowed"),
    [((), {"agv1_load_point", "agv2_load_point"}), (("agv2_load_point",), {"agv2_load_point"})],
)
def test_kit_is_allowed_where_the_cell_says(locations: tuple[str, ...], allowed: set[str]) -> None:
    client = fake_client(order("order_0", "gear_part"), locations=locations)
    (kit,) = OrderBook(cast("Client", client), Catalogue(), tuple(STATIONS.values()), Agreement().share()).open_kits()
    assert kit.allowed == allowed
