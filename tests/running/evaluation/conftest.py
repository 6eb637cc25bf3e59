"""A folder with a tiny trial and programs of every sort, and fixtures that evaluate them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, RunLimits, make_jobs
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from tests.running.evaluation.programs import PROGRAMS, TRIAL

Judge = Callable[..., list[Result]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder, which is the working folder of the evaluation."""
    (tmp_path / "tiny.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "programs.py").write_text(PROGRAMS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def tiny_jobs(folder: Path, program: str, seeds: int = 1, file: str = "programs.py") -> list[Job]:
    """Return jobs of the tiny trial."""
    trial = EvaluatedTrial("tiny", (folder / "tiny.yaml",), 6.0, 6.0, 500.0)
    return make_jobs([trial], f"{file}:{program}", range(1, seeds + 1), vary=False)


@pytest.fixture
def judge(folder: Path) -> Judge:
    """Return a function that evaluates a program of the folder."""

    def evaluate(program: str, seeds: int = 1, workers: int = 1, **limits: float) -> list[Result]:
        results: list[Result] = []
        with ResultsFile(folder / "out") as store:
            options = RunnerOptions(RunLimits(**limits), on_result=results.append)  # type: ignore[arg-type]
            LocalRunner(store, options, workers=workers).run(tiny_jobs(folder, program, seeds))
        return results

    return evaluate
