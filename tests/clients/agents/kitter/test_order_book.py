"""Orders as kits to build."""

from types import SimpleNamespace
from typing import cast

from cellwright.clients.agents.kitter.kits import OrderBook
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client import Client
from cellwright.middleware.messages.conversions import pose_message
from cellwright.middleware.messages.osrf_gear import Kit, KitObject, Order
from cellwright.util.pose import Pose


def order(name: str, *types: str) -> Order:
    return Order(name, [Kit(f"{name}_kit_0", [KitObject(each, pose_message(Pose((0.1, 0.2, 0.0)))) for each in types])])


def test_open_kits_follow_sequence_of_orders() -> None:
    client = SimpleNamespace(orders=[order("order_0", "gear_part")], time=0.0)
    book = OrderBook(cast("Client", client), Catalogue())
    (first,) = book.open_kits()
    assert [(task.type, task.tray_T_goal.position) for task in first.tasks] == [("gear_part", (0.1, 0.2, 0.0))]
    client.orders.append(order("order_1", "disk_part"))
    assert [kit.kit_type for kit in book.open_kits()] == ["order_0_kit_0", "order_1_kit_0"]
    first.is_sent = True
    assert [kit.kit_type for kit in book.open_kits()] == ["order_1_kit_0"]


def test_part_of_unknown_type_has_no_open_task() -> None:
    client = SimpleNamespace(orders=[order("order_0", "u_joint_part", "gear_part")], time=0.0)
    (kit,) = OrderBook(cast("Client", client), Catalogue()).open_kits()
    assert [task.type for task in kit.open_tasks] == ["gear_part"]
