"""Tests of progress: a moving line on a terminal, plain lines elsewhere."""

import io
import logging
from collections.abc import Callable

import pytest
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import CompetitionState, ConveyorPower, KitSubmitted, StateChanged
from cellwright.cell.kitting.kit_score import KitScore, Refusal, RefusalReason
from cellwright.cli.summary import RunProgress, effect_sentence
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial


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
