"""Tests of episodes: columns by name, times of frames, and the table of one."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pyarrow import parquet

from cellwright.recording.dataset.episode import Column
from cellwright.util.errors import UnknownNameError, UsageError
from tests.recording.dataset.sets import LENGTHS, made


def test_column_is_found_by_its_name_and_another_refused() -> None:
    episode = made(0)
    assert episode.column("action") is episode.columns[1]
    with pytest.raises(UnknownNameError, match="unknown column 'acton'; did you mean action"):
        episode.column("acton")


def test_times_rise_from_the_begin_by_the_rate() -> None:
    assert replace(made(1), begin=3.0).time[:3].tolist() == [3.0, 3.05, 3.1]


def test_table_has_each_value_under_its_name_with_type_and_unit(tmp_path: Path) -> None:
    episode = made(1)
    episode.to_parquet(tmp_path / "run.parquet")
    table = parquet.read_table(tmp_path / "run.parquet")
    states = [f"observation.state.{name}" for name in "abc"]
    assert table.column_names == ["time", *states, "action.x", "action.y", "next.reward", "next.done"]
    assert [str(table[name].type) for name in ("time", "action.x", "next.done")] == ["double", "float", "bool"]
    assert table["time"].to_pylist() == episode.time.tolist()
    assert table["action.y"].to_pylist() == episode.column("action").values[:, 1].tolist()
    assert [table.field(name).metadata for name in ("time", "action.y", "observation.state.a")] == [
        {b"unit": b"s"},
        {b"unit": b"rad"},
        None,
    ]
    facts = json.loads(table.schema.metadata[b"cellwright.episode"])
    assert (facts["source"], facts["sha256"], facts["rate"]) == ("run1.mcap", "1" * 64, 20)


def test_pictures_of_a_table_are_png_files(tmp_path: Path) -> None:
    seen = np.random.default_rng(1).integers(0, 255, (LENGTHS[0], 8, 12, 3), np.uint8)
    episode = made(0, ())
    replace(episode, columns=(*episode.columns, Column("seen", seen, ()))).to_parquet(tmp_path / "run.parquet")
    found = parquet.read_table(tmp_path / "run.parquet")["seen"].to_pylist()
    np.testing.assert_array_equal([np.asarray(Image.open(io.BytesIO(each))) for each in found], seen)


def test_table_without_its_package_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellwright.recording.dataset.episode.is_installed", lambda name: name != "pyarrow")
    with pytest.raises(UsageError, match=r"needs the package pyarrow; pip install 'cellwright\[parquet\]'"):
        made(0, ()).to_parquet(tmp_path / "run.parquet")
