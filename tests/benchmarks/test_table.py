"""Printed figures."""

import io
import math

from rich.console import Console

from benchmarks.benchmarks import BenchmarkResult, Figure
from benchmarks.report import show
from tests.benchmarks.fakes import BROKEN, FREE, HELD, FakeBenchmark

THING = FakeBenchmark("a", "A thing", 1.0)


def printed(taken: BenchmarkResult, *, with_verdicts: bool = True, colour: bool = False) -> str:
    file = io.StringIO()
    console = Console(file=file, width=80, force_terminal=colour, color_system="standard" if colour else None)
    show(console, taken, with_verdicts=with_verdicts)
    return file.getvalue()


def test_table_has_row_per_figure_and_notes_below() -> None:
    lines = [
        line.split() for line in printed(BenchmarkResult(THING, (HELD, BROKEN, FREE))).splitlines() if line.strip()
    ]
    assert lines[0] == ["A", "thing"]
    assert lines[3:] == [
        ["one", "thing", "/", "another", "1.05", "x", "≤", "1.15", "held"],
        ["a", "[note]", "with", "a", "|", "in", "it"],
        ["cold", "start", "1.50", "s", "≤", "1", "NOT", "HELD"],
        ["steps", "123457", "/s"],
    ]


def test_broken_bound_is_printed_in_red() -> None:
    text = printed(BenchmarkResult(THING, (HELD, BROKEN)), colour=True)
    assert text.count("\x1b[1;31m") == 1


def test_table_without_judgement_has_no_verdicts() -> None:
    text = printed(BenchmarkResult(THING, (HELD, BROKEN)), with_verdicts=False)
    assert "≤ 1.15" in text
    assert "held" not in text.lower()


def test_missing_figure_is_printed_with_its_note() -> None:
    text = printed(BenchmarkResult(THING, (Figure("memory", math.nan, "MiB", note="not reported by this system"),)))
    assert [line.split() for line in text.splitlines()][-2:] == [
        ["memory", "-"],
        ["not", "reported", "by", "this", "system"],
    ]


def test_long_label_is_folded_not_cut() -> None:
    label = "the time that something with a long name takes beside something else with a name as long"
    text = printed(BenchmarkResult(THING, (Figure(label, 1.0, "x", maximum=2.0),)))
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text
    words = [word for line in text.splitlines()[4:] for word in line.split()]
    assert set(label.split()) <= set(words)


def test_skipped_or_failed_benchmark_is_printed_with_reason() -> None:
    assert "skipped: no [engine]" in printed(BenchmarkResult(THING, skipped="no [engine]"))
    text = printed(BenchmarkResult(THING, (FREE,), failed="it broke"))
    assert "steps" in text
    assert "failed: it broke" in text
