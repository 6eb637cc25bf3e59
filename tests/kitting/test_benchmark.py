"""Tasks and seeds of the benchmark: complete, apart, and solvable."""

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.variation import vary
from cellwright.clients.agents.kitter.agent import KitterAgent
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.task import Held
from cellwright.running.run import RunOptions, run_cell
from cellwright.util.errors import UnknownNameError
from kitting.benchmark import ROOT, TASKS, BenchmarkTask, Split, digests, find_tasks, seeds


def test_eight_tasks_have_names_and_axes_of_their_own() -> None:
    assert len({task.name for task in TASKS}) == len({task.axis for task in TASKS}) == 8


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
@pytest.mark.parametrize("split", Split)
def test_cell_of_task_has_a_task_a_limit_and_both_cameras(task: BenchmarkTask, split: Split) -> None:
    trial = task.trial(split)
    assert trial.task is not None
    assert trial.task.reward == "shaped"
    assert trial.time_limit is not None
    assert trial.name == task.file(split).stem
    assert {each.name for each in trial.sensors if isinstance(each, PictureCameraConfig)} == {"overhead", "wrist"}
    assert task.file(split).read_text(encoding="utf-8").startswith("# Task: ")


def test_one_task_alone_is_learned_in_another_cell_with_another_part_and_place() -> None:
    others = [task for task in TASKS if task.file(Split.TRAIN) != task.file(Split.TEST)]
    assert [task.name for task in others] == ["new_part"]
    cells = [others[0].trial(split) for split in Split]
    parts = [
        condition.part for each in cells if each.task for condition in each.task.success if isinstance(condition, Held)
    ]
    assert len(set(parts)) == 2
    assert len({each.layout.bins[0].pose.position for each in cells}) == 2


def test_no_seed_is_in_both_splits() -> None:
    train, test = map(seeds, Split)
    assert len(train) == len(test) == 200
    assert not {*train} & {*test}


def test_digests_cover_every_file_of_tasks_and_seeds() -> None:
    files = [*(ROOT / "tasks").iterdir(), *(ROOT / "seeds").iterdir()]
    assert set(digests()) == {path.name for path in files}


def test_tasks_are_found_by_name_in_the_order_of_tables() -> None:
    assert find_tasks([]) == list(TASKS)
    assert [task.name for task in find_tasks(["whole_kit", "slow_belt"])] == ["slow_belt", "whole_kit"]
    with pytest.raises(UnknownNameError, match="slow_bel"):
        find_tasks(["slow_bel"])


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_bundled_agent_solves_task(task: BenchmarkTask) -> None:
    seed = seeds(Split.TEST)[0]
    cell = Cell(vary(task.trial(Split.TEST), seed), seed=seed)
    result = run_cell(cell, KitterAgent(), RunOptions())
    assert result.success, f"{result.outcome}: {result.error}"
