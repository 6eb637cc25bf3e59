"""A folder with a tiny trial and programs of every sort, and what is needed to evaluate them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO

import pytest

from cellwright.evaluation import worker_process
from cellwright.evaluation.evaluate import Evaluation
from cellwright.evaluation.job import EvaluatedTrial, Job, make_jobs
from cellwright.evaluation.limits import Limits
from cellwright.evaluation.result import Result
from cellwright.evaluation.results_file import ResultsFile
from tests.evaluation.programs import PROGRAMS, TRIAL
from tests.warm import WarmProcess, WarmStart, warm_start

Judge = Callable[..., list[Result]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder, in which the evaluation is called."""
    (tmp_path / "tiny.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "programs.py").write_text(PROGRAMS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


class _Subprocess:
    """The module `subprocess` as `worker_process` uses it, with forked workers."""

    PIPE = subprocess.PIPE

    @staticmethod
    def Popen(command: Sequence[str], *, stderr: IO[bytes], env: Mapping[str, str], **_: object) -> WarmProcess:
        def make() -> WarmStart:
            return WarmStart(("cellwright.evaluation.worker",), environment=env)

        start = warm_start("worker of an evaluation", make)
        return start.popen(command, folder=Path.cwd(), environment=env, stdin=True, stderr=stderr)


@pytest.fixture
def quick_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers of evaluations in this process are forked from one that has loaded their modules.

    Their start takes most of the processor time of a short job. Tests of the start itself, of what a worker leaves
    behind, and of equal results in several processes have workers that the evaluation starts itself.
    """
    if sys.platform != "win32":
        monkeypatch.setattr(worker_process, "subprocess", _Subprocess)


QUICK = pytest.mark.usefixtures("quick_workers")


def tiny_jobs(folder: Path, program: str, seeds: int = 1) -> list[Job]:
    """Jobs of the tiny trial."""
    trial = EvaluatedTrial("tiny", (folder / "tiny.yaml",), 6.0, 6.0, 500.0)
    return make_jobs([trial], f"programs.py:{program}", range(1, seeds + 1), vary=False)


@pytest.fixture
def judge(folder: Path) -> Judge:
    """Evaluates a program of the folder."""

    def evaluate(program: str, seeds: int = 1, workers: int = 1, **limits: float) -> list[Result]:
        results: list[Result] = []
        with ResultsFile(folder / "out") as store:
            evaluation = Evaluation(
                store,
                limits=Limits(**limits),  # type: ignore[arg-type]
                workers=workers,
                on_result=results.append,
            )
            evaluation.run(tiny_jobs(folder, program, seeds))
        return results

    return evaluate
