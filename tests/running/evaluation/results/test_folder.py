"""Tests of the folder of an evaluation: its plan, and whose evaluation it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, RunLimits
from cellwright.running.evaluation.results.folder import PLAN_NAME, other_agents, plan_of, plan_text, read_plan
from cellwright.util.errors import UsageError
from tests.running.evaluation.made_results import result

JOBS = [Job(EvaluatedTrial("tiny", (), 6.0, 6.0, 500.0), "a.py:A", seed, True, f"key {seed}") for seed in (1, 2)]


def test_plan_is_read_as_it_was_written(tmp_path: Path) -> None:
    plan = plan_of(JOBS, RunLimits())
    (tmp_path / PLAN_NAME).write_text(plan_text({**plan, "note": "of a later version"}), encoding="utf-8")
    assert read_plan(tmp_path) == plan
    assert [run["key"] for run in plan["runs"]] == ["key 1", "key 2"]


def test_plan_of_another_form_is_refused_by_its_first_misfit(tmp_path: Path) -> None:
    (tmp_path / PLAN_NAME).write_text(plan_text({**plan_of(JOBS, RunLimits()), "vary": 1}), encoding="utf-8")
    with pytest.raises(UsageError, match=r"not a plan \(vary must be true or false\); repeat that shard"):
        read_plan(tmp_path)


def test_class_folder_is_of_all_its_programs(tmp_path: Path) -> None:
    runs = [replace(result(), agent=agent) for agent in ("b.py:B", "a.py:A")]
    assert other_agents(tmp_path, runs, "a.py:A") == ["b.py:B"]
    assert other_agents(tmp_path, runs, "kitter") == ["a.py:A", "b.py:B"]
    assert other_agents(tmp_path, [], "kitter") == []
