"""Parquet tables of a data set: frames, episodes, and the sentences of tasks."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow
from numpy.typing import NDArray
from pyarrow import parquet

from cellwright.recording.dataset.layout import DATA_PATH, EPISODES_PATH, MAX_DATA_MB, TASKS, place

_COMPRESSION = "snappy"
_PANDAS_VERSION = "2.3.3"  # its form of the metadata below


class DataFiles:
    """Files of frames: one row group per episode, in files that are cut between episodes.

    Args:
        folder: of the data set.
        max_bytes: size of a file's columns in memory, which is an upper bound of its size on disk.
    """

    def __init__(self, folder: Path, max_bytes: int = MAX_DATA_MB * 1_000_000) -> None:
        self._folder, self._max_bytes = folder, max_bytes
        self._writer: Any = None
        self._number = self._bytes = 0

    def append(self, columns: Mapping[str, NDArray[Any]]) -> dict[str, int]:
        """Append the frames of an episode; return their place in columns of the table of episodes.

        Args:
            columns: values (frames,) or (frames, n), n > 1, by name.
        """
        table = pyarrow.table({name: _array(values) for name, values in columns.items()})
        if self._writer is not None and self._bytes + table.nbytes > self._max_bytes:
            self.close()
            self._number += 1
        if self._writer is None:
            path = self._folder / DATA_PATH.format(**place(self._number))
            path.parent.mkdir(parents=True, exist_ok=True)
            self._writer, self._bytes = parquet.ParquetWriter(path, table.schema, compression=_COMPRESSION), 0
        self._writer.write_table(table)
        self._bytes += table.nbytes
        return {f"data/{name}": number for name, number in place(self._number).items()}

    def close(self) -> None:
        """Finish the present file."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def write_episodes(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write the table of episodes: row i is episode i."""
    own = {f"meta/episodes/{name}": number for name, number in place(0).items()}
    path = folder / EPISODES_PATH.format(**place(0))
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(pyarrow.Table.from_pylist([{**row, **own} for row in rows]), path, compression=_COMPRESSION)


def write_tasks(folder: Path, sentences: Sequence[str]) -> None:
    """Write the sentences in the order of their numbers, as the index of a pandas table.

    LeRobot looks up sentence i as the index of row i; without the index it reads the number in its place.
    """
    columns = [("task_index", "int64", "int64"), ("task", "unicode", "object")]
    keys = ("name", "field_name", "pandas_type", "numpy_type", "metadata")
    metadata = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [dict(zip(keys, (name, name, *types, None), strict=True)) for name, *types in columns],
        "creator": {"library": "pyarrow", "version": pyarrow.__version__},
        "pandas_version": _PANDAS_VERSION,
    }
    numbers = pyarrow.array(range(len(sentences)), pyarrow.int64())
    table = pyarrow.table({"task_index": numbers, "task": pyarrow.array(sentences, pyarrow.string())})
    (folder / TASKS).parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(table.replace_schema_metadata({"pandas": json.dumps(metadata)}), folder / TASKS)


def _array(values: NDArray[Any]) -> Any:
    """Return values as a column: a plain one of scalars, or one of lists with a fixed length."""
    if values.ndim == 1:
        return pyarrow.array(values)
    return pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(values.ravel()), values.shape[1])
