"""Tests of the conclusion of an evaluation."""

from __future__ import annotations

import pytest
from rich.console import Console

from cellwright.cli.eval.conclusion import show_summary
from cellwright.running.evaluation.results.summary import Threshold
from tests.running.evaluation.made_results import CRASHED, LOST, result

BELOW = "1 of 12 points, below the required 50 % of the points"


def test_summary_fits_terminal_and_lists_worst_runs(capsys: pytest.CaptureFixture[str]) -> None:
    many = [result(1.0, seed=seed) for seed in range(10, 20)]
    show_summary(Console(width=80), [result(), CRASHED, LOST, *many], Threshold.read("50%"))
    out = capsys.readouterr().out
    lines = out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines.index("  tiny seed 3: still running after 5 s") < lines.index("  tiny seed 10: " + BELOW)
    assert "  and 2 more" in lines
    assert "passed      1 of 13 runs (95 %: 1.37 to 33.3 %)" in lines
