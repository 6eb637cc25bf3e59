"""Tests of the options of a session."""

from __future__ import annotations

from pathlib import Path

import pytest

import cellwright
from cellwright.running.run import RunOptions, RunResult, Session
from cellwright.util.errors import UsageError
from tests.support.cells import BARE


def test_run_options_apply_to_session(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    options = RunOptions(until=0.2, listen=["/clock"], checkpoints=[])
    result = Session(cellwright.Cell(BARE), options=options).run()
    assert isinstance(result, RunResult)
    assert result.heard["/clock"] == 100
    assert not file.exists()


def test_file_names_say_what_is_written(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"b\.jsonl: a\.jsonl is of this kind already"):
        Session(BARE, record=["a.jsonl", "b.jsonl"])
    with Session(BARE, record=[tmp_path / "a.jsonl", tmp_path / "a.bag"]) as session:
        result = session.run(until=0.1)
    assert result.recordings == (tmp_path / "a.bag",)
    assert {each.name for each in tmp_path.iterdir()} == {"a.jsonl", "a.bag"}
