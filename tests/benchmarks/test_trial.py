"""The benchmark's trial, and its measurement."""

from collections import Counter
from importlib.resources import files
from pathlib import Path

import pytest

from benchmarks import trial
from benchmarks.trial import bench_trial, measure
from cellwright.cell.cell import Cell
from cellwright.config.check import check


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
    bounds = Counter(figure.maximum for figure in figures.values())
    assert (bounds[1.15], bounds[1.3]) == (1, 1)
    assert all(figure.value > 0.0 for figure in figures.values())
