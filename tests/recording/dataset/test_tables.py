"""Tests of the tables of a data set."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
from pyarrow import parquet

from cellwright.recording.dataset.layout import place
from cellwright.recording.dataset.tables import DataFiles


def test_files_of_frames_are_cut_between_episodes(tmp_path: Path) -> None:
    columns: dict[str, Any] = {"action": np.zeros((10, 2), np.float32), "index": np.arange(10)}
    files = DataFiles(tmp_path, max_bytes=400)
    places = [files.append(columns) for _ in range(3)]
    files.close()
    assert [each["data/file_index"] for each in places] == [0, 0, 1]
    first = parquet.ParquetFile(tmp_path / "data/chunk-000/file-000.parquet")
    assert (first.metadata.num_row_groups, first.metadata.num_rows) == (2, 20)
    assert first.schema_arrow.field("action").type == pyarrow.list_(pyarrow.float32(), 2)
    assert first.schema_arrow.field("index").type == pyarrow.int64()


def test_file_after_a_full_chunk_is_in_the_next_one() -> None:
    assert place(1001) == {"chunk_index": 1, "file_index": 1}
