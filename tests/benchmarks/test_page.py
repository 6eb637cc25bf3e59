"""The whole page."""

import datetime

from benchmarks.benchmarks import BenchmarkResult
from benchmarks.report import HEAD, cell, page
from tests.benchmarks.fakes import BROKEN, FREE, HELD, FakeBenchmark

DAY = datetime.date(2026, 11, 21)
TAKEN = [
    BenchmarkResult(FakeBenchmark("first", "A first thing", 1.0), (HELD, FREE, BROKEN)),
    BenchmarkResult(FakeBenchmark("second", "A second thing", 1.0), skipped="no such engine"),
    BenchmarkResult(FakeBenchmark("third", "A third thing", 1.0), (FREE,), failed="it\nbroke"),
]

EXPECTED = """
## The machine

| | |
|---|---|
| date | 2026-11-21 |
| processor | Fast One |

## A first thing

`python -m benchmarks first`

What it is.

How it is measured.

| figure | value | bound | | note |
|---|---|---|---|---|
| one thing / another | 1.05 x | ≤ 1.15 | held | a [note] with a \\| in it |
| steps | 123457 /s | | | |
| cold start | 1.50 s | ≤ 1 | NOT HELD | |

## A second thing

`python -m benchmarks second`

What it is.

How it is measured.

Skipped: no such engine.

## A third thing

`python -m benchmarks third`

What it is.

How it is measured.

| figure | value | bound | | note |
|---|---|---|---|---|
| steps | 123457 /s | | | |

Failed: it broke.
"""


def test_page_has_machine_and_section_per_benchmark() -> None:
    assert page(TAKEN, {"processor": "Fast One"}, DAY) == HEAD + EXPECTED


def test_page_of_quick_run_is_marked_rough() -> None:
    rough = page(TAKEN, {}, DAY, quick=True)
    assert "**These figures are rough:**" in rough
    assert "| cold start | 1.50 s | ≤ 1 | | |" in rough  # rough figures are not judged


def test_table_cell_escapes_bars_and_line_breaks() -> None:
    assert cell("a | b\n\n c") == "a \\| b c"
