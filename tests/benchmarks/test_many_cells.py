"""Many cells on threads and in processes."""

import pytest

from benchmarks import many_cells
from benchmarks.benchmarks import BenchmarkSkippedError
from benchmarks.many_cells import Arrangement, arrangements, measure, run
from cellwright.util.errors import UsageError


def test_arrangements_share_cells_evenly() -> None:
    assert arrangements(1) == [Arrangement(1)]
    assert [str(each) for each in arrangements(4)] == [
        "4 cells, 1 thread",
        "4 cells, 2 threads",
        "4 cells, 2 processes",
    ]
    for count in many_cells.COUNTS:
        assert many_cells.STEPS % count == 0
        assert all(count % (each.processes * each.threads) == 0 for each in arrangements(count))


def test_many_cells_on_one_processor_are_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many_cells, "usable_processors", lambda: 1)
    with pytest.raises(BenchmarkSkippedError, match="two processors"):
        next(measure(print))


@pytest.mark.slow
def test_many_cells_quick_run_yields_ratios_of_rates() -> None:
    progress: list[str] = []
    alone, threads, processes, of_threads, of_processes = measure(progress.append, quick=True)
    assert progress == [f"2 cells, {place}, repeat 1" for place in ("1 thread", "2 threads", "2 processes")]
    assert alone.value > 0.0
    assert of_threads.value == pytest.approx(threads.value / alone.value)
    assert of_processes.value == pytest.approx(processes.value / alone.value)


@pytest.mark.slow
def test_many_cells_failing_process_is_reported() -> None:
    with pytest.raises(UsageError, match="max_workers must be greater than 0"):
        run(Arrangement(1, threads=0), 16)
