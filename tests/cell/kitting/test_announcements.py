import pytest

from cellwright.cell.kitting.effects import AnnouncementReason
from cellwright.cell.kitting.inventory import TrayContents
from cellwright.cell.kitting.referee import NOW, Announcements, count_parts
from cellwright.config.trial.trial import Order
from cellwright.engine.clock import NEVER
from tests.cell.kitting.builders import order, tray_object

GEAR, DISK, PULLEY = tray_object("gear_part"), tray_object("disk_part"), tray_object("pulley_part")
BAD_GEAR = tray_object("gear_part", faulty=True)
AT_ONCE = (NOW, AnnouncementReason.IDLE)
BY_WANTED = (NOW, AnnouncementReason.WANTED_PARTS)
BY_UNWANTED = (NOW, AnnouncementReason.UNWANTED_PARTS)


def test_orders_wait_by_start_time_then_file_order() -> None:
    orders = [
        order(0, wanted_parts=1),
        order(1, start_time=5.0),
        order(2),
        order(3, start_time=-1.0),
        order(4, start_time=5.0),
        order(5, unwanted_parts=1),
    ]
    announcements = Announcements(orders)
    assert [each.order_id[-1] for each in announcements.waiting] == list("314025")
    assert announcements.announce().order_id == "order_3"
    assert [each.order_id[-1] for each in announcements.waiting] == list("14025")


@pytest.mark.parametrize(
    ("waiting", "trays", "idle", "due"),
    [
        # by time
        (order(start_time=0.0), [], True, (0, AnnouncementReason.TIME)),
        (order(start_time=2.5), [], False, (2_500_000_000, AnnouncementReason.TIME)),
        (order(start_time=-3.0), [], True, (-3_000_000_000, AnnouncementReason.TIME)),
        (order(start_time=1e300), [], True, (NEVER, AnnouncementReason.TIME)),
        # no condition, or one that is switched off
        (order(), [], True, None),
        (order(wanted_parts=0), [(GEAR,)], True, None),
        (order(unwanted_parts=-1), [(DISK,)], True, None),
        # no order in progress
        (order(wanted_parts=3), [], True, AT_ONCE),
        (order(unwanted_parts=3), [()], True, AT_ONCE),
        # wanted parts
        (order(wanted_parts=1), [(), ()], False, None),
        (order(wanted_parts=1), [(GEAR,), ()], False, BY_WANTED),
        (order(wanted_parts=1), [(), (DISK, GEAR)], False, BY_WANTED),
        (order(wanted_parts=1), [(BAD_GEAR, DISK)], False, None),
        (order(wanted_parts=2), [(GEAR, GEAR)], False, None),
        (order(wanted_parts=2, kits=2), [(GEAR, GEAR)], False, BY_WANTED),
        (order(wanted_parts=2, kits=2), [(GEAR,), (GEAR,)], False, None),
        # unwanted parts
        (order(unwanted_parts=1), [(GEAR,)], False, None),
        (order(unwanted_parts=1), [(GEAR, GEAR)], False, BY_UNWANTED),
        (order(unwanted_parts=2), [(DISK,), (PULLEY,)], False, None),
        (order(unwanted_parts=2), [(), (DISK, PULLEY)], False, BY_UNWANTED),
        (order(unwanted_parts=1), [(BAD_GEAR,)], False, None),
    ],
)
def test_order_is_due_by_time_parts_or_idle(
    waiting: Order, trays: list[TrayContents], idle: bool, due: tuple[int, AnnouncementReason] | None
) -> None:
    assert Announcements([waiting]).due(trays, idle=idle) == due


def test_order_behind_conditional_order_waits() -> None:
    announcements = Announcements([order(0, wanted_parts=1), order(1, ("disk_part",), wanted_parts=1)])
    assert announcements.due([(DISK,)], idle=False) is None
    assert announcements.due([(GEAR, DISK)], idle=False) == BY_WANTED


def test_nothing_is_due_when_all_orders_are_announced() -> None:
    announcements = Announcements([order(start_time=0.0)])
    announcements.announce()
    assert announcements.due([], idle=True) is None
    assert announcements.waiting == ()


@pytest.mark.parametrize(
    ("contents", "counts"),
    [
        ((), (0, 0)),
        ((GEAR, GEAR, DISK, PULLEY), (3, 1)),
        ((GEAR, GEAR, GEAR, BAD_GEAR), (2, 1)),
        ((BAD_GEAR, PULLEY, PULLEY), (0, 2)),
    ],
)
def test_count_parts_counts_each_ordered_part_once(contents: TrayContents, counts: tuple[int, int]) -> None:
    assert count_parts(order(0, ("gear_part", "disk_part"), kits=2), contents) == counts
