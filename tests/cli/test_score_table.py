"""The score table: it fits, and says which point was lost and why."""

import io
import math

import pytest
from rich.console import Console

from cellwright.cli import score_table
from cellwright.cli.score_table import REASONS
from cellwright.kitting.kit_score import BonusVerdict, ExtraObject, ExtraReason, Fit, KitScore, PartFinding, Verdict
from cellwright.pose import Pose

LONG = "populate_conveyor|piston_rod_part_clone_123"


def kit(*parts: PartFinding, extras: tuple[ExtraObject, ...] = ()) -> KitScore:
    return KitScore("order_0_kit_0", is_submitted=True, parts=parts, extras=extras)


def part(verdict: Verdict, name: str = "bin7|piston_rod_part_5", distance: float = 0.0312) -> PartFinding:
    fit = None if verdict is Verdict.MISSING else Fit(name, distance, 0.99, math.radians(12.34))
    return PartFinding("piston_rod_part", Pose(), verdict, fit)


def printed(score: KitScore, width: int = 80) -> list[str]:
    console = Console(file=io.StringIO(), width=width, highlight=False)
    console.print(score_table.table(score))
    text = console.file.getvalue()  # type: ignore[attr-defined]
    return [line.rstrip() for line in text.splitlines()]


def test_a_row_says_what_was_found_and_what_was_lost() -> None:
    rows = printed(kit(part(Verdict.TOO_FAR), part(Verdict.PLACED, distance=0.0012), part(Verdict.MISSING)))
    assert rows[0].split() == ["off", "turn"]
    assert rows[1].split() == ["part", "found", "mm", "deg", "there", "pose", "lost"]
    assert rows[3].split() == ["piston_rod_part", "bin7|piston_rod_part_5", "31.2", "12.3", "1", "0", "too", "far"]
    assert rows[4].split() == ["piston_rod_part", "bin7|piston_rod_part_5", "1.2", "12.3", "1", "1"]
    assert rows[5].split() == ["piston_rod_part", "-", "0", "0", "missing"]


@pytest.mark.parametrize("verdict", list(Verdict))
def test_nothing_is_cut_in_80_columns(verdict: Verdict) -> None:
    rows = printed(kit(part(verdict, LONG, distance=1.23456)))
    assert max(map(len, rows)) <= 80
    assert "…" not in "".join(rows)
    if verdict is not Verdict.MISSING:
        assert "".join(row[17:43].strip() for row in rows[3:5]) == LONG


def test_every_loss_has_a_reason() -> None:
    assert set(REASONS) == {*Verdict, *BonusVerdict} - {Verdict.PLACED, BonusVerdict.EARNED}
    lost = kit(*(part(verdict) for verdict in Verdict))
    told = [line.partition(": ")[0] for line in score_table.reasons(lost)]
    assert told == ["too far", "tilted", "turned", "faulty", "missing", "parts short"]
    assert list(score_table.reasons(kit(part(Verdict.PLACED)))) == []


def test_what_is_besides_on_the_tray_costs_the_bonus() -> None:
    extra = ExtraObject("bin8|gear_part_1", "gear_part", ExtraReason.WRONG_TYPE)
    score = kit(part(Verdict.PLACED), extras=(extra,))
    console = Console(file=io.StringIO(), width=80, highlight=False)
    for line in score_table.sums(score):
        console.print(line, markup=False)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert "there 1 of 1, pose 1 of 1, bonus 0 of 1" in text
    assert "besides: bin8|gear_part_1 (wrong type)" in text
    assert "extra objects: the tray holds more than was ordered" in text
