"""Tests of kits that were never submitted: what waits on the trays, and what it would have earned."""

import json
from collections.abc import Mapping
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.kitting.evidence import NO_PARTS, ON_ITS_WAY, REASONS, KitEvidence, evidence, evidence_to_json
from cellwright.cell.kitting.inventory import TrayContents
from cellwright.cell.kitting.kit_score import score_kit
from cellwright.cell.kitting.scorer import Scorer
from cellwright.cell.kitting.unsent import unsent_trays
from cellwright.config.trial.trial import Order, Part, Trial
from cellwright.util.pose import Pose
from tests.cell.kitting.builders import TRAY_1, TRAY_2, TYPES, full_tray, kit, order, ordered, tray_object

GEARS = order(0, ("gear_part", "gear_part"), start_time=0.0)
LATER = order(1, ("disk_part",), start_time=99.0)
CELL = tuple(Part(f"bin5|{kind}_{n}", kind, Pose()) for kind in TYPES for n in range(9))


def kits_of(
    trays: dict[str, TrayContents] | None,
    first: Order = GEARS,
    *,
    submits: bool = False,
    sent: Mapping[str, str] = MappingProxyType({}),
) -> list[KitEvidence]:
    """Return the evidence after an order was announced, and its first kit submitted or not."""
    scorer = Scorer((first, LATER))
    scorer.begin(0)
    scorer.announce(first.order_id, 0)
    if submits:
        scorer.submit(first.kits[0].kit_type, full_tray(first), 1)
    trial = Trial("t", orders=(first, LATER), bin_parts=CELL)
    found = evidence(trial, scorer.game_score(9), 9, trays=trays, sent=sent)
    return [each for order in found.orders for each in order.kits]


def test_kit_never_submitted_names_parts_on_tray_and_their_points() -> None:
    there = (tray_object(name="bin5|gear_part_1"), tray_object("disk_part", 0.2))
    found = kits_of({TRAY_1: (), TRAY_2: there})[0]
    words = "agv2's tray held 1 gear_part, 1 disk_part; as this kit it would have earned 2 of 6 points"
    assert list(found.unsent_sentences()) == [f"{words} (there 1, pose 1, bonus 0)"]
    assert found.bonus_sentence == f"its kit was never submitted; {words} (there 1, pose 1, bonus 0)"
    assert found.score.total == 0.0  # an explanation earns nothing


def test_kit_on_its_way_says_so_and_names_its_points() -> None:
    there = (tray_object(name="bin5|gear_part_1"),)
    found = kits_of({TRAY_1: full_tray(GEARS), TRAY_2: there}, sent={TRAY_2: GEARS.kits[0].kit_type})[0]
    sent, waiting = found.unsent_sentences()
    assert sent.startswith("agv2 was on its way with 1 gear_part; as this kit it would have earned 2 of 6 points (")
    assert waiting.startswith("agv1's tray held 2 gear_part; as this kit it would have earned 6 of 6 points (")
    assert found.bonus_sentence == f"{REASONS[ON_ITS_WAY]}; {sent}; {waiting}"
    assert [part.cause for part in found.parts] == [ON_ITS_WAY] * 2
    assert [part.sentence() for part in found.parts] == [REASONS[ON_ITS_WAY]] * 2
    assert found.score.total == 0.0


def test_empty_tray_on_its_way_says_so() -> None:
    found = kits_of({TRAY_1: ()}, sent={TRAY_1: GEARS.kits[0].kit_type})[0]
    assert found.bonus_sentence == f"{REASONS[ON_ITS_WAY]}; {NO_PARTS}"


def test_agv_on_its_way_with_another_kit_leaves_reason() -> None:
    there = {TRAY_1: full_tray(GEARS)}
    assert kits_of(there, sent={TRAY_1: "order_0_kit_7"}) == kits_of(there)
    assert kits_of(there, sent={TRAY_1: GEARS.kits[0].kit_type})[1] == kits_of(there)[1]  # of an unannounced order


def test_submitted_kit_on_its_way_again_keeps_its_score() -> None:
    there, again = {TRAY_2: full_tray(GEARS)}, {TRAY_2: GEARS.kits[0].kit_type}
    assert kits_of(there, submits=True, sent=again)[0] == kits_of(there, submits=True)[0]


def test_faulty_part_on_waiting_tray_is_named_and_earns_nothing() -> None:
    (found,) = unsent_trays(kit(ordered()), {TRAY_1: (tray_object(faulty=True), tray_object(x=0.2, faulty=True))})
    assert found.sentence().startswith("agv1's tray held 2 faulty gear_part; as this kit it would have earned 0 of 3")


def test_better_tray_comes_first() -> None:
    trays = {TRAY_1: (tray_object(x=0.3),), TRAY_2: (tray_object(),)}
    assert [each.tray for each in unsent_trays(kit(ordered()), trays)] == ["agv2", "agv1"]


@pytest.mark.parametrize("trays", [{}, {TRAY_1: (), TRAY_2: ()}])
def test_kit_never_submitted_without_parts_says_so(trays: dict[str, TrayContents]) -> None:
    assert list(kits_of(trays)[0].unsent_sentences()) == [NO_PARTS]


def test_unknown_trays_submitted_kits_and_unannounced_orders_say_nothing() -> None:
    there = {TRAY_1: full_tray(GEARS)}
    silent = [kits_of(None)[0], kits_of(there, submits=True)[0], kits_of(there)[1]]
    assert [(each.unsent, list(each.unsent_sentences())) for each in silent] == [(None, [])] * 3


def test_open_kits_of_an_order_are_each_judged() -> None:
    two = order(0, ("gear_part",), kits=2, start_time=0.0)
    first, second, _ = kits_of({TRAY_1: full_tray(two)}, two, submits=True)
    assert first.unsent is None
    assert [each.score.total for each in second.unsent or ()] == [3.0]


def test_json_has_parts_and_points_of_waiting_trays() -> None:
    trial = Trial("t", orders=(GEARS,), bin_parts=CELL)
    scorer = Scorer(trial.orders)
    scorer.announce(GEARS.order_id, 0)
    found = evidence(trial, scorer.game_score(9), trays={TRAY_1: (tray_object(faulty=True),)})
    (tray,) = json.loads(json.dumps(evidence_to_json(found)))["orders"][0]["kits"][0]["unsent"]
    assert tray["parts"] == [{"name": "bin5|gear_part_1", "type": "gear_part", "faulty": True}]
    assert (tray["tray"], tray["would_earn"], tray["part_presence"]) == ("agv1", 0.0, 0.0)
    assert tray["on_its_way"] is False


OBJECTS = st.builds(
    tray_object,
    st.sampled_from(TYPES),
    st.floats(-0.2, 0.2),
    st.floats(-0.3, 0.3),
    name=st.uuids().map(lambda each: f"bin5|{each}"),
    faulty=st.booleans(),
)


@given(st.dictionaries(st.sampled_from((TRAY_1, TRAY_2)), st.lists(OBJECTS, max_size=4).map(tuple)))
def test_points_of_waiting_tray_are_those_of_its_submission(trays: dict[str, TrayContents]) -> None:
    found = unsent_trays(GEARS.kits[0], trays)
    by_tray = {link.partition("::")[0]: contents for link, contents in trays.items() if contents}
    assert {each.tray: each.score for each in found} == {
        tray: score_kit(GEARS.kits[0], contents) for tray, contents in by_tray.items()
    }
    totals = [each.score.total for each in found]
    assert totals == sorted(totals, reverse=True)
