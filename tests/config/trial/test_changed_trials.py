"""Trials with entries dropped, doubled, renamed and retyped: each is a cell that runs, or is refused in plain lines."""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.config.models.files import ModelFileError
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import DescriptionError, SimulationError
from fuzz import seeds, target, yaml_trees
from fuzz.targets.trial import WORDS
from fuzz.trees import mutated
from fuzz.verdict import FindingError, check_lines, check_refusal

ROOT = Path(__file__).resolve().parents[3]
FILES = [find_trial("lesson"), find_trial("final11"), ROOT / "docs" / "examples" / "own_models" / "own_models.yaml"]
TREES = [yaml.safe_load(file.read_text()) for file in FILES]
quiet = settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])


def load(path: Path) -> Trial | None:
    """Return the trial in a file, or None if it is refused correctly."""
    try:
        loaded = load_trial([path])
    except DescriptionError as error:
        check_refusal(error, str(path))
        return None
    check_lines(loaded.warnings, [str(path)])
    return loaded.trial


def write_mutated(folder: Path, tree: object, rng: random.Random) -> Path:
    path = folder / "trial.yaml"
    path.write_bytes(yaml_trees.text(mutated(tree, rng, WORDS)))
    return path


@pytest.mark.slow
@settings(quiet, max_examples=80)
@given(tree=st.sampled_from(TREES), rng=st.randoms())
def test_mutated_trial_is_read_or_refused(tmp_path: Path, tree: object, rng: random.Random) -> None:
    load(write_mutated(tmp_path, tree, rng))


@settings(quiet, max_examples=20)
@given(tree=st.sampled_from(TREES[:2]), rng=st.randoms())
def test_mutated_trial_that_loads_can_run(tmp_path: Path, tree: object, rng: random.Random) -> None:
    trial = load(write_mutated(tmp_path, tree, rng))
    if trial is not None:
        with contextlib.suppress(ModelFileError, SimulationError):
            cell = Cell(trial)
            for _ in range(10):
                cell.step()
            assert len(cell.state_hash()) == 64


@pytest.mark.parametrize(
    "case",
    [case for name in target.names() for case in seeds.cases(name)],
    ids=lambda case: f"{case.parent.name}-{case.name}",
)
def test_former_fuzz_findings_stay_fixed(case: Path) -> None:
    target.find(case.parent.name).attempt(case.read_bytes())


@pytest.mark.parametrize("line", ["what is wrong", "a.yaml: ", "a.yaml:3: two\nlines", "a.yaml:3: \x1b[2J"])
def test_check_lines_detects_useless_lines(line: str) -> None:
    with pytest.raises(FindingError):
        check_lines([line], ["a.yaml"])
    check_lines(["a.yaml:3: key: what is wrong"], ["a.yaml"])
