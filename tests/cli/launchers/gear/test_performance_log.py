"""Tests of the log that scripts of 2017 search."""

import os
import re
from pathlib import Path

import pytest

from cellwright.cell.kitting.effects import (
    AnnouncementReason,
    CompetitionState,
    ConveyorPower,
    Effect,
    EndReason,
    KitSubmitted,
    OrderAnnounced,
    OrderCompleted,
    StateChanged,
    TrialEnded,
)
from cellwright.cell.kitting.kit_score import KitScore, PartFinding, Refusal, RefusalReason, Verdict
from cellwright.cell.kitting.scorer import GameScore, OrderScore
from cellwright.cli.launchers.gear.launcher import PerformanceLog, log_path, score_lines
from cellwright.config.trial.trial import Order
from cellwright.util.pose import Pose

PLACED = PartFinding("gear_part", Pose(), Verdict.PLACED)
FAR = PartFinding("gear_part", Pose(), Verdict.TOO_FAR)
KIT = KitScore("order_0_kit_0", True, (PLACED, FAR))
ORDER = OrderScore("order_0", (KIT, KitScore("order_0_kit_1")), 12_500_000_000)
GAME = GameScore((ORDER,), 3_000_000_000)


def refuse_to_report(line: str) -> None:
    raise AssertionError(line)


def test_score_block_has_format_of_original() -> None:
    assert list(score_lines(GAME, 20_000_000_000)) == [
        "<game_score>",
        "Total game score: [5]",
        "Total process time: [20.000]",
        "Part travel time: [3.000]",
        "<order_score order_0>",
        "Total order score: [5]",
        "Time taken: [12.500]",
        "Complete: [false]",
        "<kit_score order_0_kit_0>",
        "Total kit score: [5]",
        "Complete: [false]",
        "Submitted: [true]",
        "Part presence score: [2]",
        "All parts bonus: [2]",
        "Part pose score: [1]",
        "</kit_score>",
        "<kit_score order_0_kit_1>",
        "Total kit score: [0]",
        "Complete: [false]",
        "Submitted: [false]",
        "Part presence score: [0]",
        "All parts bonus: [0]",
        "Part pose score: [0]",
        "</kit_score>",
        "</order_score>",
        "</game_score>",
    ]


def test_log_of_trial_has_line_for_each_event(tmp_path: Path) -> None:
    path = log_path(tmp_path)
    assert path == tmp_path / ".ariac" / "log" / "performance.log"
    log = PerformanceLog(path, refuse_to_report)
    refused = KitScore("kit", refusal=Refusal(RefusalReason.UNKNOWN_KIT_TYPE, "kit"))
    effects: list[Effect] = [
        StateChanged(CompetitionState.GO),
        ConveyorPower(100.0),
        OrderAnnounced(Order("order_0", ()), AnnouncementReason.TIME),
        KitSubmitted("tray", "order_0_kit_0", KIT),
        KitSubmitted("tray", "kit", refused),
        OrderCompleted(ORDER),
        TrialEnded(EndReason.COMMAND, GAME, 20_000_000_000),
    ]
    for second, effect in enumerate(effects):
        log.effect(effect, second * 10**9)
    text = path.read_text()
    assert text.splitlines()[:7] == [
        "[0.000] State: go",
        "[2.000] Announcing order: order_0 (time)",
        "[3.000] Submitted tray: tray as order_0_kit_0: [5]",
        "[4.000] Submitted tray: tray as kit: [0]",
        "[4.000] scored 0: kit type 'kit' belongs to no order (ordered now: none)",
        "[5.000] Order complete: order_0: [5]",
        "[6.000] Trial over: ended by command",
    ]
    log.score(GAME, 1)  # it is written already
    log.close()
    assert path.read_text() == text
    assert re.findall(r"<game_score>\nTotal game score: \[(.*)\]", text) == ["5"]
    assert text.endswith("</game_score>\n")


def test_log_of_interrupted_trial_has_score(tmp_path: Path) -> None:
    log = PerformanceLog(tmp_path / "log", refuse_to_report)
    log.score(GAME, 0)
    log.close()
    log.close()
    assert (tmp_path / "log").read_text().startswith("<game_score>\nTotal game score: [5]\n")


def test_new_log_replaces_old_link(tmp_path: Path) -> None:
    path = log_path(tmp_path)
    path.parent.mkdir(parents=True)
    elsewhere = tmp_path / "default.log"
    elsewhere.write_text("of another user\n")
    path.symlink_to(elsewhere)
    PerformanceLog(path, refuse_to_report).close()
    assert path.read_text() == ""
    assert elsewhere.read_text() == "of another user\n"


def test_unwritable_log_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / ".ariac").touch()
    warnings: list[str] = []
    log = PerformanceLog(log_path(tmp_path), warnings.append)
    log.effect(StateChanged(CompetitionState.GO), 0)
    log.close()
    assert len(warnings) == 1
    assert "score log cannot be written: " in warnings[0]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_full_disk_is_reported_once(tmp_path: Path) -> None:
    warnings: list[str] = []
    log = PerformanceLog(Path("/dev/full"), warnings.append)
    log.effect(StateChanged(CompetitionState.GO), 0)
    log.effect(StateChanged(CompetitionState.DONE), 1)
    assert warnings == ["/dev/full: cannot be written any more: No space left on device"]
