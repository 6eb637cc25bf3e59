"""The benchmark's trial, and its measurement."""

from importlib.resources import files
from pathlib import Path

import pytest

from benchmarks import trial
from benchmarks.checkout import OURS
from benchmarks.trial import bench_trial, compare, measure
from cellwright.cell.cell import Cell
from cellwright.config.check import check
from cellwright.util.errors import UsageError


def test_bench_trial_passes_check_without_warnings() -> None:
    report = check([Path(str(files("benchmarks") / "trial.yaml"))])
    assert (report.ok, report.warnings) == (True, ())


def test_bench_trial_has_all_kinds_of_content() -> None:
    found = bench_trial()
    assert found.time_limit == trial.SECONDS
    assert len(found.bin_parts) >= 60
    assert found.options.belt_population_cycles * max(part.time for part in found.belt_parts) >= 480
    assert len(found.orders) > 1
    assert {each.type for each in found.sensors} == {
        "break_beam",
        "laser_profiler",
        "logical_camera",
        "proximity_sensor",
    }
    names = {name.rpartition("|")[2] for name in Cell(found).parts.names}
    assert set(found.faulty_parts) <= names


def test_bench_trial_parts_are_at_rest() -> None:
    cell = Cell(bench_trial())
    cell.simulation.step_until(10**9)
    data = cell.simulation.data
    assert sum(data.tree_asleep < 0) <= 1  # the arm


@pytest.mark.slow
def test_three_measured_runs_end_in_same_state() -> None:
    progress: list[str] = []
    figures = {figure.label: figure for figure in measure(progress.append, quick=True)}
    assert len(progress) == 3
    assert figures["different end states of the three"].value == 1
    assert all(figure.value > 0.0 for figure in figures.values())


@pytest.mark.slow
def test_comparison_of_checkout_with_itself_yields_ratio() -> None:
    progress: list[str] = []
    own, other, ratio, *shares = compare(OURS, progress.append, quick=True)
    assert progress == ["this checkout, run 1", "the other checkout, run 1"]
    assert ratio.value == pytest.approx(other.value / own.value)
    assert ratio.minimum == 1.4
    assert len(shares) == 2
    assert all(figure.value > 0.0 for figure in shares)


def test_comparison_of_different_trials_is_refused(tmp_path: Path) -> None:
    for name in ("src/cellwright/__init__.py", "benchmarks/trial.py", "benchmarks/trial.yaml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    with pytest.raises(UsageError, match="is not the trial of this checkout"):
        next(iter(compare(tmp_path, print)))
