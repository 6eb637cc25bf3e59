"""`python -m kitting`: what it prints, and what it refuses."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from cellwright.cli.main import main
from kitting import __main__ as command
from kitting.benchmark import TASKS, Split
from kitting.evaluate import RunRecord, Runs
from tests.cli.conftest import CommandLine, Ran
from tests.kitting.runs import record


@pytest.fixture
def kitting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """The command, whose runs all succeed at once, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(command, "evaluate", evaluated)

    def run(*arguments: str) -> Ran:
        capsys.readouterr()
        status = main(arguments, command.app, name="python -m kitting")
        return Ran(status, *capsys.readouterr())

    return run


def evaluated(runs: Runs, words: Sequence[str], folder: Path) -> list[RunRecord]:
    """Return records of runs that have all succeeded; note their words in the folder."""
    numbers = runs.seeds
    folder.mkdir(parents=True)
    (folder / "words.json").write_text(json.dumps([*words, runs.record, runs.fresh, runs.split]), encoding="utf-8")
    return [record(task.name, seed, success=True) for task in runs.tasks for seed in numbers]


def test_tasks_are_listed_with_their_sentences(kitting: CommandLine) -> None:
    lines = kitting("tasks").out.splitlines()
    assert lines[0] == "pick_from_bin  Pick up a gear from the bin."
    assert len(lines) == 2 * len(TASKS)


def test_demonstrations_are_recorded_on_the_seeds_of_training(kitting: CommandLine) -> None:
    ran = kitting("demonstrate", "--task", "slow_belt", "--seeds", "4", "--out", "o")
    assert ran.status == 0
    assert "| `slow_belt` | 4 of 4, 51 to 100 % |" in ran.out
    words = json.loads(Path("o/demonstrations/words.json").read_text(encoding="utf-8"))
    assert words == ["--agent", "kitting.demonstrator:Demonstrator", True, False, Split.TRAIN]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (["kitter"], ["--agent", "kitter", True, False, Split.TEST]),
        (["clone"], ["--agent", "kitting.clone.agent:Clone", False, True, Split.TEST]),
        (["mine", "--agent", "a.py:A"], ["--agent", "a.py:A", False, False, Split.TEST]),
        (
            ["mine", "--policy", "hold", "--latency", "60ms"],
            ["--policy", "hold", "--latency", "60ms", False, False, Split.TEST],
        ),
    ],
)
def test_program_is_scored_on_the_seeds_of_the_test(
    name: list[str], words: list[object], kitting: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KITTING_CLONE", "networks")
    ran = kitting("score", *name, "--seeds", "2", "--task", "whole_kit", "--out", "o")
    assert ran.status == 0
    assert f"| task | {name[0]} |" in ran.out
    assert "0.001 core hours" in ran.out
    assert json.loads(Path(f"o/scores/{name[0]}/words.json").read_text(encoding="utf-8")) == words


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["score", "mine"], "mine: is no baseline (random, hold, kitter, replay, clone); give its program: --agent"),
        (["score", "hold", "--agent", "a.py:A"], "hold: is a baseline, a program of its own; leave out --agent"),
        (["score", "../up", "--agent", "a.py:A"], "../up: a name has letters, digits, - and _; take another"),
        (["score", "replay", "--out", "o"], "replay: needs the recorded runs of kitter; run python -m kitting score"),
        (["score", "hold", "--task", "slow"], "unknown task 'slow'"),
        (["score", "hold", "--seeds", "201"], "--seeds 201: give a number from 1 to 200"),
        (["table", "--out", "o"], "o: has no scores; run python -m kitting score NAME first"),
        (
            ["train", "--out", "o"],
            "o/demonstrations: has no recording of pick_from_bin; run python -m kitting demonstrate",
        ),
        (["verify", "none.json"], "none.json: cannot be read"),
        (["submit", "none.json", "s"], "none.json: cannot be read"),
    ],
)
def test_bad_input_is_refused_with_what_to_do(arguments: list[str], message: str, kitting: CommandLine) -> None:
    ran = kitting(*arguments)
    assert ran.status == 2
    assert message in ran.err


def test_entrant_without_a_field_is_refused(kitting: CommandLine) -> None:
    Path("entrant.json").write_text('{"name": "mine"}', encoding="utf-8")
    ran = kitting("submit", "entrant.json", "s", "--agent", "a.py:A")
    assert ran.status == 2
    assert "entrant.json: " in ran.err
    assert "authors" in ran.err
