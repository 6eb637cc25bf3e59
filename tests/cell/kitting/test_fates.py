"""Fates of missing parts, from the last handling of the parts of their type; each part stands for one at most."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.kitting.fates import Fate, FateKind, HandlingRecord, PartSnapshot, Removal
from cellwright.cell.kitting.inventory import TrayObject, part_type
from cellwright.cell.kitting.kit_score import Verdict, score_kit
from cellwright.util.pose import Pose
from tests.cell.kitting.builders import TRAY_1, TRAY_2, TYPES, kit, ordered, tray_object

SECOND = 1_000_000_000
GEAR, SPARE = "bin5|gear_part_1", "bin5|gear_part_2"
OVER_BIN, IN_BIN = (-0.3, 0.2, 1.0), (-0.3, 0.2, 0.73)
NOW = 20 * SECOND


def gear(
    position: tuple[float, float, float] = IN_BIN,
    *,
    name: str = GEAR,
    tray: str = "",
    above: str = "",
    faulty: bool = False,
) -> PartSnapshot:
    return PartSnapshot(name, "gear_part", position, tray, above, faulty)


def carry(record: HandlingRecord, name: str = GEAR, *, at: int = 5, is_forced: bool = False) -> None:
    """Let the gripper take a part at a time [s], hold it for 3.1 s and release it over a bin."""
    record.take(name, at * SECOND)
    record.let_go(name, OVER_BIN, at * SECOND + 3_100_000_000, is_forced=is_forced)


def fates(record: HandlingRecord, *parts: PartSnapshot, count: int = 1) -> list[Fate]:
    """Return the fates of the gears that an empty tray 1 lacks."""
    score = score_kit(kit(*(ordered("gear_part", 0.1 * n) for n in range(count))), ())
    found = record.judge(score, TRAY_1, (), parts, NOW)
    return [fate for fate in found if fate is not None]


def sentence_of(record: HandlingRecord, *parts: PartSnapshot) -> str:
    (fate,) = fates(record, *parts)
    return fate.sentence()


def test_part_never_held_has_fate_never_held() -> None:
    assert sentence_of(HandlingRecord(), gear()) == "never gripped"


def test_parts_removed_by_deletion_wall_are_counted() -> None:
    record = HandlingRecord()
    for name in (GEAR, SPARE):
        record.remove(name, Removal.DELETION_WALL)
    assert sentence_of(record, gear(), gear(name=SPARE)) == (
        "never gripped; the deletion wall of the belt removed 2 of its type"
    )


def test_parts_that_fell_off_the_belt_are_counted() -> None:
    record = HandlingRecord()
    record.remove(GEAR, Removal.DELETION_WALL)
    fallen = replace(gear(name=SPARE), has_fallen=True)
    (fate,) = fates(record, gear(), fallen)
    assert (fate.past, fate.fallen) == (1, 1)
    assert fate.sentence().endswith("removed 1 of its type; 1 of its type fell off the belt")


def test_part_that_fell_after_it_was_held_has_its_own_fate() -> None:
    record = HandlingRecord()
    carry(record)
    (fate,) = fates(record, replace(gear(), has_fallen=True))
    assert (fate.kind, fate.fallen) == (FateKind.DROPPED, 0)


def test_part_released_above_rest_is_dropped_else_put_down() -> None:
    for position, words in ((IN_BIN, "dropped"), ((-0.3, 0.2, 0.995), "put down")):
        record = HandlingRecord()
        carry(record)
        more = " after 3.1 s in the gripper" if words == "dropped" else ""
        assert sentence_of(record, gear(position)) == f"{GEAR} was {words} at (-0.30, 0.20) m{more}"


def test_forced_drop_has_final_position_of_part() -> None:
    record = HandlingRecord()
    carry(record, is_forced=True)
    assert sentence_of(record, gear((0.8, 1.0, 0.0))) == (
        f"{GEAR} was lost to a forced drop at (-0.30, 0.20) m after 3.1 s in the gripper; it lay at (0.80, 1.00) m"
    )


def test_part_on_other_tray_or_fallen_off_tray_is_reported() -> None:
    record = HandlingRecord()
    carry(record)
    record.report(TRAY_2, [GEAR])
    assert sentence_of(record, gear(tray=TRAY_2)) == f"{GEAR} was on agv2's tray"
    record = HandlingRecord()
    carry(record)
    record.report(TRAY_1, [GEAR])
    assert sentence_of(record, gear((0.9, 2.9, 0.0))) == f"{GEAR} fell off agv1's tray; it lay at (0.90, 2.90) m"


def test_part_lifted_from_tray_did_not_fall_off() -> None:
    record = HandlingRecord()
    record.take(GEAR, 5 * SECOND)
    record.report(TRAY_1, [GEAR])
    record.let_go(GEAR, OVER_BIN, 6 * SECOND, is_forced=False)
    assert fates(record, gear())[0].kind is FateKind.DROPPED


def test_part_on_other_part_is_stacked() -> None:
    record = HandlingRecord()
    carry(record)
    assert sentence_of(record, gear((0.19, 3.1, 0.76), above=TRAY_1)) == (
        f"{GEAR} lay above agv1's tray without touching its plate, at (0.19, 3.10) m"
    )


def test_part_put_down_after_last_report_is_unreported() -> None:
    record = HandlingRecord()
    carry(record)
    assert sentence_of(record, gear(OVER_BIN, tray=TRAY_1)) == (
        f"{GEAR} was put down at (-0.30, 0.20) m, after the tray's last report"
    )


def test_part_in_gripper_or_out_of_cell_is_reported() -> None:
    record = HandlingRecord()
    record.take(GEAR, 15 * SECOND)
    assert sentence_of(record, gear()) == f"{GEAR} was in the gripper for 5.0 s"
    for by, words in (
        (Removal.DELETION_WALL, "was removed by the deletion wall of the belt"),
        (Removal.CLEARING, "was cleared from agv2's tray"),
    ):
        record = HandlingRecord()
        carry(record)
        record.report(TRAY_2, [GEAR])
        record.remove(GEAR, by)
        assert sentence_of(record, gear()) == f"{GEAR} {words}"


def test_latest_part_is_named_first_and_faulty_last() -> None:
    record = HandlingRecord()
    carry(record, SPARE, at=4)
    carry(record, GEAR, at=9)
    bad = "bin5|gear_part_3"
    carry(record, bad, at=12)
    found = fates(record, gear(), gear(name=SPARE), gear(name=bad, faulty=True), count=4)
    assert [fate.part for fate in found] == [GEAR, SPARE, bad, ""]
    assert found[2].sentence().startswith(f"{bad} (faulty) was dropped")


def test_part_of_earlier_kit_or_delivery_is_not_named_again() -> None:
    record = HandlingRecord()
    carry(record)
    assert fates(record, gear())[0].part == GEAR
    later = score_kit(kit(ordered("gear_part"), kit_type="order_0_kit_1"), ())
    (fate,) = record.judge(later, TRAY_2, (), [gear()], NOW)
    assert fate is not None
    assert fate.kind is FateKind.NEVER_HELD
    record = HandlingRecord()
    carry(record)
    record.remove(GEAR, Removal.DELIVERY)
    assert sentence_of(record, gear()) == "never gripped"


NAMES = tuple(f"bin5|{kind}_{number}" for kind in TYPES for number in range(3))
EVENTS = st.lists(
    st.tuples(st.sampled_from(("take", "let go", "forced", "report", *Removal)), st.sampled_from(NAMES)), max_size=20
)


def record_of(events: list[tuple[str, str]]) -> HandlingRecord:
    record = HandlingRecord()
    for number, (event, name) in enumerate(events):
        now = number * SECOND
        match event:
            case "take":
                record.take(name, now)
            case "let go" | "forced":
                record.let_go(name, OVER_BIN, now, is_forced=event == "forced")
            case "report":
                record.report(TRAY_2, [name])
            case by:
                record.remove(name, Removal(by))
    return record


@given(EVENTS, st.lists(st.sampled_from(TYPES), max_size=6), st.sets(st.sampled_from(NAMES)), st.booleans())
def test_missing_parts_have_one_fate_each_also_after_restore(
    events: list[tuple[str, str]], types: list[str], on_tray: set[str], is_restored: bool
) -> None:
    record = record_of(events)
    if is_restored:
        kept = json.loads(json.dumps(record.get_record()))
        record = record_of([("take", NAMES[0])])
        record.set_record(kept)
    contents: tuple[TrayObject, ...] = tuple(tray_object(part_type(name), name=name) for name in sorted(on_tray))
    score = score_kit(kit(*(ordered(each, 0.1 * n) for n, each in enumerate(types))), contents)
    now = [PartSnapshot(name, part_type(name), Pose().position) for name in NAMES]

    found = record.judge(score, TRAY_1, on_tray, now, NOW)

    assert [fate is not None for fate in found] == [each.verdict is Verdict.MISSING for each in score.parts]
    named = Counter(fate.part for fate in found if fate is not None and fate.part)
    assert set(named.values()) <= {1}
    assert not named.keys() & on_tray
    for fate, part in zip(found, score.parts, strict=True):
        assert fate is None or not fate.part or part_type(fate.part) == part.type
        assert fate is None or fate.sentence()
    assert record.fates(score.kit_type) == found
    assert record_of(events).judge(score, TRAY_1, on_tray, now, NOW) == found
    restored = HandlingRecord()
    restored.set_record(json.loads(json.dumps(record.get_record())))
    assert restored.fates(score.kit_type) == found
