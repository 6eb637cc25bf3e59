import pytest

from cellwright.cell.kitting.kit_score import KitScore, PartFinding, Refusal, RefusalReason, Verdict
from tests.cell.kitting.builders import pose


@pytest.mark.parametrize(
    ("verdict", "presence", "points_for_pose"),
    [
        (Verdict.PLACED, 1.0, 1.0),
        (Verdict.TOO_FAR, 1.0, 0.0),
        (Verdict.TILTED, 1.0, 0.0),
        (Verdict.TURNED, 1.0, 0.0),
        (Verdict.FAULTY, 0.0, 0.0),
        (Verdict.MISSING, 0.0, 0.0),
    ],
)
def test_verdict_has_its_points(verdict: Verdict, presence: float, points_for_pose: float) -> None:
    finding = PartFinding("gear_part", pose(), verdict)
    assert (finding.presence, finding.pose) == (presence, points_for_pose)


def test_unjudged_kit_has_no_points_and_no_bonus_verdict() -> None:
    score = KitScore("order_0_kit_0")
    assert score.total == score.maximum == 0.0
    assert score.bonus is None
    assert not score.is_complete


@pytest.mark.parametrize(
    ("refusal", "sentence"),
    [
        (
            Refusal(RefusalReason.UNKNOWN_KIT_TYPE, "kit_O", None, ("kit_0",)),
            "scored 0: kit type 'kit_O' belongs to no order; did you mean kit_0 (ordered now: kit_0)",
        ),
        (
            Refusal(RefusalReason.NOT_ANNOUNCED, "kit_1", "order_1", ("x", "y")),
            "scored 0: kit type 'kit_1' belongs to order_1, which is not announced yet (ordered now: x, y)",
        ),
        (
            Refusal(RefusalReason.ORDER_CLOSED, "order_1_kit_0", "order_1"),
            "scored 0: kit type 'order_1_kit_0' belongs to order_1, which is already closed (ordered now: none)",
        ),
    ],
)
def test_refusal_sentence_has_reason_and_accepted_kits(refusal: Refusal, sentence: str) -> None:
    assert refusal.sentence() == sentence
