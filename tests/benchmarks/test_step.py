"""Cost of a step."""

from benchmarks.step import measure, trial_with
from cellwright.cell.cell import Cell


def test_trial_parts_exist_and_come_to_rest() -> None:
    cell = Cell(trial_with(100))
    cell.simulation.step_until(10**9)
    assert len(cell.parts.all) == 100
    assert sum(cell.simulation.data.tree_asleep < 0) <= 1  # the arm


def test_step_quick_run_yields_figures() -> None:
    progress: list[str] = []
    figures = list(measure(progress.append, quick=True))
    assert progress == ["0 parts", "60 parts"]
    assert all(figure.value > 0.0 for figure in figures)
    assert [figure.label for figure in figures if figure.maximum is not None] == ["60 parts at rest / arm only"]
