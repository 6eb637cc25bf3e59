"""Benchmarks with figures, skipped ones, and failures half-way."""

import json
import subprocess
from pathlib import Path

import pytest

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, run_benchmark
from cellwright.util.errors import RunEndedError, UsageError
from tests.benchmarks.fakes import BROKEN, CURVE, FREE, HELD, FakeBenchmark


def test_taken_benchmark_has_figures_and_progress() -> None:
    progress: list[str] = []
    taken = run_benchmark(FakeBenchmark("a", "A thing", 1.0, (HELD, FREE)), progress.append)
    assert (taken.figures, taken.skipped, taken.failed, taken.is_held) == ((HELD, FREE), "", "", True)
    run_benchmark(FakeBenchmark("a", "A thing", 1.0), progress.append, quick=True)
    assert progress == ["measuring well", "measuring quickly"]


def test_comparison_with_checkout_adds_figures() -> None:
    progress: list[str] = []
    fake = FakeBenchmark("a", "A thing", 1.0, (HELD,), compared=(FREE,))
    assert run_benchmark(fake, print).figures == (HELD,)
    assert run_benchmark(fake, progress.append, against=Path("before")).figures == (HELD, FREE)
    assert progress == ["measuring well", "comparing with before"]


def test_curve_is_kept_apart_from_figures() -> None:
    taken = run_benchmark(FakeBenchmark("a", "A thing", 1.0, (HELD, CURVE, FREE)), print)
    assert (taken.figures, taken.curves) == ((HELD, FREE), (CURVE,))
    assert json.loads(json.dumps(taken.as_dict()))["curves"][0]["costs"] == [20.0, 30.0, 40.0]


def test_broken_bound_is_not_held() -> None:
    assert not run_benchmark(FakeBenchmark("a", "A thing", 1.0, (HELD, BROKEN)), print).is_held


def test_skipped_benchmark_is_held() -> None:
    taken = run_benchmark(FakeBenchmark("a", "A thing", 1.0, error=BenchmarkSkippedError("no such engine")), print)
    assert (taken.skipped, taken.failed, taken.is_held) == ("no such engine", "", True)


def test_failed_benchmark_keeps_earlier_figures() -> None:
    taken = run_benchmark(FakeBenchmark("a", "A thing", 1.0, (HELD,), UsageError("it broke")), print)
    assert (taken.figures, taken.failed, taken.is_held) == ((HELD,), "it broke", False)


@pytest.mark.parametrize(
    "error",
    [
        RunEndedError("the server has closed the connection"),
        subprocess.TimeoutExpired("rospy", 120.0),
        subprocess.CalledProcessError(1, "rospy"),
        BrokenPipeError(32, "Broken pipe"),
    ],
)
def test_error_of_other_process_fails_only_its_benchmark(error: BaseException) -> None:
    taken = run_benchmark(FakeBenchmark("a", "A thing", 1.0, (HELD,), error), print)
    assert (taken.figures, taken.failed, taken.is_held) == ((HELD,), str(error), False)


def test_programming_error_is_raised() -> None:
    with pytest.raises(ZeroDivisionError):
        run_benchmark(FakeBenchmark("a", "A thing", 1.0, error=ZeroDivisionError()), print)


def test_result_as_dict_is_valid_json_with_null_for_nan() -> None:
    nothing = Figure("nothing", float("nan"), maximum=1.0)
    taken = run_benchmark(FakeBenchmark("a", "A thing", 1.0, (HELD, nothing)), print)
    document = json.loads(json.dumps(taken.as_dict(), allow_nan=False))
    assert {key: document[key] for key in ("name", "title", "skipped", "failed", "held")} == {
        "name": "a",
        "title": "A thing",
        "skipped": None,
        "failed": None,
        "held": False,
    }
    assert document["figures"][0] == {
        "what": "one thing / another",
        "value": 1.049,
        "unit": "x",
        "most": 1.15,
        "least": None,
        "held": True,
        "note": "a [note] with a | in it",
    }
    assert (document["figures"][1]["value"], document["figures"][1]["held"]) == (None, False)
