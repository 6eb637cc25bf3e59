"""Tests of the score as a table, and of the progress of a run."""

import io
import logging
from collections.abc import Callable
from dataclasses import replace

import pytest
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.attainable import AttainableKit, AttainablePart
from cellwright.cell.kitting.effects import CompetitionState, ConveyorPower, KitSubmitted, StateChanged
from cellwright.cell.kitting.evidence import (
    NO_PARTS,
    NOT_ANNOUNCED,
    NOT_SUBMITTED,
    OFF_TRAY,
    ON_ITS_WAY,
    REASONS,
    KitEvidence,
    kit_evidence,
)
from cellwright.cell.kitting.fates import Fate, FateKind
from cellwright.cell.kitting.inventory import TrayObject
from cellwright.cell.kitting.kit_score import (
    BonusVerdict,
    ExtraObject,
    ExtraReason,
    Fit,
    KitScore,
    PartFinding,
    Refusal,
    RefusalReason,
    Verdict,
)
from cellwright.cell.kitting.unsent import UnsentTray
from cellwright.cli import summary
from cellwright.cli.summary import RunProgress, effect_sentence
from cellwright.cli.tables import print_table
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.pose import Pose
from tests.support.places import TRAY_PLATE

LONG = "populate_conveyor|piston_rod_part_clone_123"


def kit(*parts: PartFinding, extras: tuple[ExtraObject, ...] = (), off_plate: float = 0.0) -> KitEvidence:
    places = tuple(
        AttainablePart(part.type, part.tray_T_goal, off_plate, off_plate, is_supplied=True, plate=TRAY_PLATE)
        for part in parts
    )
    score = KitScore("order_0_kit_0", is_submitted=True, parts=parts, extras=extras)
    return kit_evidence(score, AttainableKit("order_0_kit_0", places))


def part(verdict: Verdict, name: str = "bin7|piston_rod_part_5", distance: float = 0.0312) -> PartFinding:
    fit = None if verdict is Verdict.MISSING else Fit(name, distance, 0.99, 0.2154)
    return PartFinding("piston_rod_part", Pose(), verdict, fit)


def unjudged(*, is_announced: bool) -> KitEvidence:
    place = AttainablePart("piston_rod_part", Pose(), 0.0, 0.0, is_supplied=True, plate=TRAY_PLATE)
    return kit_evidence(KitScore("kit"), AttainableKit("kit", (place,)), is_announced=is_announced)


def printed(found: KitEvidence, width: int = 80) -> list[str]:
    console = Console(file=io.StringIO(), width=width, highlight=False)
    print_table(console, summary.kit_table(found))
    text = console.file.getvalue()  # type: ignore[attr-defined]
    return [line.rstrip() for line in text.splitlines()]


def test_row_shows_found_part_and_lost_points() -> None:
    rows = printed(kit(part(Verdict.TOO_FAR), part(Verdict.PLACED, distance=0.0012), part(Verdict.MISSING)), width=90)
    assert rows[0].split() == ["part", "found", "off", "mm", "turn", "mrad", "there", "pose", "lost"]
    assert rows[2].split() == ["piston_rod_part", "bin7|piston_rod_part_5", "31.2", "215", "1", "0", "too", "far"]
    assert rows[3].split() == ["piston_rod_part", "bin7|piston_rod_part_5", "1.2", "215", "1", "1"]
    assert rows[4].split() == ["piston_rod_part", "-", "0", "0", "missing"]


@pytest.mark.parametrize("off_plate", [0.0, 0.5])
@pytest.mark.parametrize("verdict", list(Verdict))
def test_table_in_80_columns_cuts_nothing(verdict: Verdict, off_plate: float) -> None:
    rows = printed(kit(part(verdict, LONG, distance=1.23456), off_plate=off_plate))
    assert max(map(len, rows)) <= 80
    assert "…" not in "".join(rows)
    if verdict is not Verdict.MISSING:
        assert "".join(row[17:42].strip() for row in rows[-2:]) == LONG


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        (
            "populate_conveyor|hydraulic_manifold_bracket_left_part_clone_12",
            ["populate_conveyor|", "hydraulic_manifold_", "bracket_left_part_", "clone_12"],
        ),
        ("bin7|anamewithoutawordinwhichitcouldbebroken", ["bin7|", "anamewithoutawordinwhichitcouldbebroken"]),
    ],
)
def test_long_name_is_folded_between_words_or_widens_table(name: str, lines: list[str]) -> None:
    kind = "anamewithoutawordinwhichitcouldbebroken" if "broken" in name else "hydraulic_manifold_part"
    fit = Fit(name, 123.4567, 0.99, 3.1)
    rows = printed(kit(PartFinding(kind, Pose(), Verdict.TOO_FAR, fit), part(Verdict.MISSING)))
    text = "\n".join(rows)
    assert "…" not in text
    assert all(line in [word for row in rows for word in row.split()] for line in lines)
    assert all(word in text for word in ("123456.7", "3100", "too far", "missing"))


def test_long_kit_name_stays_on_one_line() -> None:
    console = Console(file=io.StringIO(), width=80, highlight=False)
    name = "order_of_a_name_that_goes_on_and_on_beyond_all_measure_in_the_second_qualification_kit_0"
    place = AttainablePart("piston_rod_part", Pose(), 0.0, 0.0, is_supplied=True, plate=TRAY_PLATE)
    found = kit_evidence(KitScore(name), AttainableKit(name, (place,)))
    summary.show_kit(console, "order_0", found)
    assert f"order_0, kit {name}: not submitted, no points" in console.file.getvalue().splitlines()  # type: ignore[attr-defined]


@pytest.mark.parametrize("is_announced", [True, False])
def test_kit_without_score_lists_its_parts(is_announced: bool) -> None:
    found = unjudged(is_announced=is_announced)
    rows = printed(found)
    assert max(map(len, rows)) <= 80
    cause = NOT_SUBMITTED if is_announced else NOT_ANNOUNCED
    assert rows[-1].split() == ["piston_rod_part", "-", "0", "0", *cause.split()]
    assert list(summary.kit_lines(found)) == ["", f"  {cause}: {REASONS[cause]}"]


def test_kit_never_submitted_says_what_its_trays_would_have_earned() -> None:
    score = KitScore("kit", is_submitted=True, parts=(part(Verdict.TOO_FAR), part(Verdict.MISSING)))
    tray = UnsentTray("agv2", (TrayObject("bin7|piston_rod_part_5", "piston_rod_part", False, Pose()),), score)
    lines = list(summary.kit_lines(replace(unjudged(is_announced=True), unsent=(tray,))))
    assert lines[1:] == [
        "  not submitted: its kit was never submitted",
        "    agv2's tray held 1 piston_rod_part; as this kit it would have earned 1 of 6",
        "      points (there 1, pose 0, bonus 0)",
    ]
    assert list(summary.kit_lines(replace(unjudged(is_announced=True), unsent=())))[2:] == [f"    {NO_PARTS}"]


def test_kit_on_its_way_says_so_and_what_it_would_have_earned() -> None:
    score = KitScore("kit", is_submitted=True, parts=(part(Verdict.TOO_FAR), part(Verdict.MISSING)))
    tray = UnsentTray(
        "agv1", (TrayObject("bin7|piston_rod_part_5", "piston_rod_part", False, Pose()),), score, is_sent=True
    )
    found = unjudged(is_announced=True)
    parts = tuple(replace(each, cause=ON_ITS_WAY) for each in found.parts)
    console = Console(file=io.StringIO(), width=80, highlight=False)
    summary.show_kit(console, "order_0", replace(found, parts=parts))
    assert "order_0, kit kit: on its way, no points" in console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert list(summary.kit_lines(replace(found, parts=parts, unsent=(tray,))))[1:] == [
        "  on its way: its AGV was on its way, and had not submitted the kit yet",
        "    agv1 was on its way with 1 piston_rod_part; as this kit it would have earned",
        "      1 of 6 points (there 1, pose 0, bonus 0)",
    ]


def test_each_loss_has_a_reason() -> None:
    causes = {*Verdict, *BonusVerdict, NOT_SUBMITTED, ON_ITS_WAY, NOT_ANNOUNCED, OFF_TRAY}
    assert set(REASONS) == causes - {Verdict.PLACED, BonusVerdict.EARNED}
    lost = kit(*(part(verdict) for verdict in Verdict))
    kinds = [line.partition(": ")[0] for line in summary.loss_lines(lost)]
    assert kinds == ["too far", "tilted", "turned", "faulty", "missing", "parts short"]
    assert list(summary.loss_lines(kit(part(Verdict.PLACED)))) == []


def test_fates_of_missing_parts_are_below_reason() -> None:
    fates = [
        Fate(FateKind.NEVER_HELD),
        Fate(FateKind.NEVER_HELD),
        Fate(FateKind.HELD, "bin7|piston_rod_part_5", held=1),
    ]
    found = kit(*[part(Verdict.MISSING)] * 3)
    found = kit_evidence(found.score, found.attainable, fates=fates)
    assert list(summary.kit_lines(found))[2:5] == [
        "  missing: not on the tray at submission",
        "    piston_rod_part (2): never gripped",
        "    piston_rod_part: bin7|piston_rod_part_5 was in the gripper for 0.0 s",
    ]


def test_place_off_the_tray_is_listed_as_out_of_reach() -> None:
    lines = list(summary.loss_lines(kit(part(Verdict.TOO_FAR, distance=0.6), off_plate=0.5)))
    assert lines == [
        "off tray: its place lies off the tray (0.5 x 0.7 m), out of reach of any part",
        "out of reach: 1 of 1 places lies 0.50 m off the tray, at least 500 mm from any part on it",
    ]
    assert max(map(len, summary.kit_lines(kit(part(Verdict.MISSING), off_plate=0.5)))) <= 80


def test_extra_objects_on_tray_lose_bonus() -> None:
    extra = ExtraObject("bin8|gear_part_1", "gear_part", ExtraReason.WRONG_TYPE)
    text = "\n".join(summary.kit_lines(kit(part(Verdict.PLACED), extras=(extra,))))
    assert "there 1 of 1, pose 1 of 1, bonus 0 of 1" in text
    assert "besides: bin8|gear_part_1 (wrong type)" in text
    assert "extra objects: the tray holds more than was ordered" in text


class WallClock:
    """Wall time that passes only when the test advances it."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def text(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def lesson() -> Cell:
    return Cell(load_trial([find_trial("lesson")]).trial)


def test_progress_without_terminal_prints_line_every_two_seconds() -> None:
    console, clock, cell = Console(file=io.StringIO(), width=80), WallClock(), lesson()
    progress = RunProgress(console, clock=clock)
    with progress.running(cell):
        for _ in range(50):
            cell.step()
            clock.now += 0.1
            progress.update(cell)
    assert text(console).splitlines() == ["    0.044 s  0.0 x real time, init", "    0.086 s  0.0 x real time, init"]


def test_progress_updated_twice_at_same_time_does_not_fail() -> None:
    console, clock, cell = Console(file=io.StringIO()), WallClock(), lesson()
    progress = RunProgress(console, clock=clock)
    with progress.running(cell):
        clock.now += 10.0  # a picture was drawn meanwhile
        progress.update(cell)
        progress.update(cell)
    assert "x real time" not in text(console)


def test_progress_on_terminal_is_a_line_that_disappears(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    console = Console(file=io.StringIO(), force_terminal=True, force_interactive=True, width=80)
    clock, cell = WallClock(), lesson()
    progress = RunProgress(console, until=1.0, clock=clock)
    with progress.running(cell):
        for _ in range(3):
            clock.now += 0.2
            progress.update(cell)
    assert "simulating" in text(console)
    assert text(console).endswith("\x1b[2K")  # the line is erased


def logged(level: Callable[[str], None], *, verbose: bool) -> str:
    console = Console(file=io.StringIO(), width=80)
    with RunProgress(console, verbose=verbose).running(lesson()):
        level("two\nlines [bold]")
    level("too late")
    return text(console)


def test_log_message_is_printed_with_simulation_time() -> None:
    log = logging.getLogger("an.agent")
    assert logged(log.info, verbose=True) == "    0.000 s  two\n    0.000 s  lines [bold]\n"
    assert logged(log.info, verbose=False) == ""
    assert logged(log.warning, verbose=False).startswith("    0.000 s  two\n")


def test_effect_sentence_describes_each_effect() -> None:
    assert effect_sentence(StateChanged(CompetitionState.GO)) == "competition: go"
    assert effect_sentence(ConveyorPower(100.0)) == ""
    refused = KitScore("kit", refusal=Refusal(RefusalReason.UNKNOWN_KIT_TYPE, "kit", None, ("order_0_kit_0",)))
    sentence = effect_sentence(KitSubmitted("agv1::kit_tray_1::kit_tray_1::tray", "kit", refused))
    assert (
        sentence
        == "kit_tray_1 submitted as kit: scored 0: kit type 'kit' belongs to no order (ordered now: order_0_kit_0)"
    )
