"""Tests of the progress of an evaluation."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from cellwright.cli.eval.progress import EvalProgress
from cellwright.running.evaluation.execution.runner import Running
from cellwright.running.evaluation.plan.job import EvaluatedTrial, make_jobs
from tests.running.evaluation.made_results import LOST, result
from tests.running.evaluation.programs import TRIAL


def test_progress_on_terminal_is_a_live_table(tmp_path: Path) -> None:
    (tmp_path / "tiny.yaml").write_text(TRIAL)
    trial = EvaluatedTrial("tiny", (tmp_path / "tiny.yaml",), 12.0, 12.0, 500.0)
    endless = EvaluatedTrial("endless", (tmp_path / "tiny.yaml",), 12.0, 12.0, None)
    jobs = make_jobs([trial], "lesson", [1, 2, 3], vary=False)
    other = make_jobs([endless], "lesson", [4], vary=False)
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=80, height=40, highlight=False, _environ={})
    with EvalProgress(console, [*jobs, *other]) as progress:
        progress.begin([result()], tmp_path)
        progress.show_jobs([Running(jobs[2], 3.0, 42.0, 5.0), Running(other[0], 3.0, 7.0, 1.0)])
        progress.take(LOST)
    text = screen.getvalue()
    for words in ("1 of them has a result", "[2/4] tiny seed 3", "2/3", "0/1", "42 of 500 s", "7 s", "5 points"):
        assert words in text, words
