"""Check of the tables of a data set: frames, episodes and sentences, their types, their order and their places."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
from numpy.typing import NDArray
from pyarrow import parquet

from cellwright.recording.dataset.described import Description, Feature, unreadable
from cellwright.recording.dataset.layout import DATA_PATH, RECORDING_COLUMNS, TASKS, VIDEO_COLUMNS

_TIME_TOLERANCE = 1e-4  # [s], that of LeRobot's readers
_EPISODE_COLUMNS = (
    "episode_index",
    "length",
    "dataset_from_index",
    "dataset_to_index",
    "data/chunk_index",
    "data/file_index",
)
_TEXTS = (pyarrow.string(), pyarrow.large_string())


@dataclass
class Rows:
    """Contents of the tables, as far as they could be read.

    Attributes:
        columns: values of the features that are numbers or truths, (frames, n) or (frames,).
        starts: first row of each episode, and the number of all rows, as the tables of frames have them.
        files: file of each episode in the tables of frames.
        episodes: rows of the table of episodes; empty if they cannot be used.
    """

    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    starts: list[int] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    episodes: list[dict[str, Any]] = field(default_factory=list)


def check_rows(described: Description, problems: list[str]) -> Rows:
    """Read all tables of a set, and append what is wrong with them."""
    rows = Rows()
    sentences = _check_tasks(described, problems)
    paths, parts = _paths(described.folder, "data", problems), []
    for path in paths:
        table = _read(path, problems)
        if table is not None and _check_types(path, table, described.columns, problems):
            parts.append((path, table))
    if parts and len(parts) == len(paths):
        _check_frames(described, parts, rows, problems)
    _check_episodes(described, rows, sentences, problems)
    return rows


def _check_tasks(described: Description, problems: list[str]) -> list[str]:
    path = described.folder / TASKS
    table = _read(path, problems)
    if table is None:
        return []
    if sorted(table.column_names) != ["task", "task_index"]:
        problems.append(f"{path}: columns must be task and task_index (got {', '.join(table.column_names)})")
        return []
    if table["task"].type not in _TEXTS:
        problems.append(f"{path}: task: must be a column of texts (got {table['task'].type})")
        return []
    numbers, sentences = table["task_index"].to_pylist(), table["task"].to_pylist()
    if _pandas_index(table) != ["task"]:
        problems.append(f"{path}: pandas metadata must name task as the index (got {_pandas_index(table)})")
    if numbers != list(range(len(numbers))):
        problems.append(f"{path}: task_index must be the number of its row (got {numbers[:10]})")
    if len(numbers) != described.tasks:
        problems.append(f"{path}: must have the total_tasks of info.json, {described.tasks} (got {len(numbers)})")
    if len({*sentences}) != len(sentences):
        problems.append(f"{path}: a task stands in one row alone (got {len(sentences) - len({*sentences})} again)")
    return [str(each) for each in sentences]


def _pandas_index(table: Any) -> Any:
    """Return the names of the index in the metadata of a table; None without any."""
    try:
        return json.loads((table.schema.metadata or {})[b"pandas"])["index_columns"]
    except (KeyError, TypeError, ValueError):
        return None


def _check_types(path: Path, table: Any, features: Mapping[str, Feature], problems: list[str]) -> bool:
    """Append what is wrong with the columns of a table; return whether their values can be read."""
    before = len(problems)
    problems += [f"{path}: {name}: column is missing" for name in features if name not in table.column_names]
    problems += [f"{path}: {name}: no feature of info.json" for name in table.column_names if name not in features]
    for name, feature in features.items():
        if name not in table.column_names or len(feature.shape) > 1 or feature.dtype == "image":
            continue
        column, expected = table[name], _type(feature)
        if column.type != expected:
            problems.append(f"{path}: {name}: must be a column of {expected} (got {column.type})")
        elif column.null_count:
            problems.append(f"{path}: {name}: has no value in {column.null_count} rows")
    return len(problems) == before


def _type(feature: Feature) -> Any:
    scalar = pyarrow.bool_() if feature.dtype == "bool" else getattr(pyarrow, feature.dtype)()
    return scalar if feature.shape == (1,) else pyarrow.list_(scalar, feature.shape[0])


def _check_frames(described: Description, parts: list[tuple[Path, Any]], rows: Rows, problems: list[str]) -> None:
    """Compare each frame's own numbers with its place; fill `rows`."""
    plain = {
        name: each
        for name, each in described.columns.items()
        if each.dtype not in ("string", "image") and len(each.shape) == 1
    }
    table = pyarrow.concat_tables([part.select([*plain]) for _, part in parts])
    files = [str(path) for path, part in parts for _ in range(part.num_rows)]
    if table.num_rows != described.frames:
        path = described.folder / "data"
        problems.append(f"{path}: must have total_frames of info.json, {described.frames} (got {table.num_rows})")
    if not table.num_rows:
        return
    rows.columns = {name: _values(table[name], feature) for name, feature in plain.items()}
    for name, values in rows.columns.items():
        if (bad := np.flatnonzero(~np.isfinite(values.reshape(len(values), -1)).all(axis=1))).size:
            problems.append(
                f"{files[bad[0]]}: {name}: must be finite (got {values[bad[0]]} in row {bad[0]} of the set)"
            )
    episode = rows.columns["episode_index"]
    steps = np.diff(episode)
    if episode[0] != 0 or ((steps != 0) & (steps != 1)).any():
        row = 0 if episode[0] else int(np.flatnonzero((steps != 0) & (steps != 1))[0]) + 1
        text = f"episode_index must rise by one from 0 (got {episode[row]} in row {row} of the set)"
        problems.append(f"{files[row]}: {text}")
        return
    starts = np.searchsorted(episode, np.arange(episode[-1] + 1))
    rows.starts = [*starts.tolist(), len(episode)]
    rows.files = [files[start] for start in starts]
    frame = np.arange(len(episode)) - starts[episode]
    expected = {"index": np.arange(len(episode)), "frame_index": frame, "timestamp": frame / described.rate}
    for name, values in expected.items():
        tolerance = _TIME_TOLERANCE if name == "timestamp" else 0
        bad = np.flatnonzero(np.abs(rows.columns[name] - values) > tolerance)
        if bad.size:
            text = f"{name} must be {values[bad[0]]} in row {bad[0]} of the set (got {rows.columns[name][bad[0]]})"
            problems.append(f"{files[bad[0]]}: {text}")
    task = rows.columns["task_index"]
    if (bad := np.flatnonzero((task < 0) | (task >= described.tasks))).size:
        problems.append(f"{files[bad[0]]}: task_index must be below {described.tasks} (got {task[bad[0]]})")


def _values(column: Any, feature: Feature) -> NDArray[Any]:
    """Return the values of a column, (frames, n) or (frames,)."""
    if feature.shape == (1,):
        return np.asarray(column.to_numpy())
    flat = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return np.asarray(flat).reshape(-1, feature.shape[0])


def _check_episodes(described: Description, rows: Rows, sentences: list[str], problems: list[str]) -> None:
    """Compare the table of episodes with the frames, and keep its rows if videos can be judged by them."""
    videos = [f"videos/{key}/{name}" for key in described.videos for name in VIDEO_COLUMNS]
    needed = [*_EPISODE_COLUMNS, *videos]
    found: list[tuple[Path, dict[str, Any]]] = []
    for path in _paths(described.folder, "meta/episodes", problems):
        table = _read(path, problems)
        if table is None:
            return
        missing = [name for name in needed if name not in table.column_names]
        problems += [f"{path}: {name}: column is missing" for name in missing]
        if missing:
            return
        wanted = [name for name in (*needed, "tasks", *RECORDING_COLUMNS) if name in table.column_names]
        found += [(path, row) for row in table.select(wanted).to_pylist()]
    for path, row in found:
        if wrong := [name for name in needed if not _is_number(row[name], is_time=name.endswith("timestamp"))]:
            problems.append(f"{path}: {wrong[0]}: must be a number of at least 0 (got {row[wrong[0]]!r})")
            return
    for name, number in (("total_episodes of info.json", described.episodes), ("the frames", len(rows.files))):
        if number != len(found) and (rows.files or name.startswith("total")):
            path = described.folder / "meta/episodes"
            problems.append(f"{path}: must have as many episodes as {name}, {number} (got {len(found)})")
    ordered = True
    for number, (path, row) in enumerate(found):
        wrong = _wrong_episode(number, row, described, rows, sentences)
        problems += [f"{path}: episode {number}: {text}" for text in wrong]
        ordered = ordered and row["episode_index"] == number
    rows.episodes = [row for _, row in found] if ordered else []


def _wrong_episode(
    number: int, row: dict[str, Any], described: Description, rows: Rows, sentences: list[str]
) -> list[str]:
    if row["episode_index"] != number:
        return [f"episode_index must be the number of its row (got {row['episode_index']})"]
    if number >= len(rows.files):
        return []
    start, end = rows.starts[number : number + 2]
    expected = {"length": end - start, "dataset_from_index": start, "dataset_to_index": end}
    found = [f"{name} must be {value} (got {row[name]})" for name, value in expected.items() if row[name] != value]
    place = {name: row[f"data/{name}"] for name in ("chunk_index", "file_index")}
    path = str(described.folder / DATA_PATH.format(**place))
    if path != rows.files[number]:
        found.append(f"its frames must be in {rows.files[number]} (got {path})")
    numbers = {*rows.columns["task_index"][start:end].tolist()}
    of_frames = {sentences[each] for each in numbers if 0 <= each < len(sentences)}
    tasks = row.get("tasks", sorted(of_frames))
    if sentences and (not isinstance(tasks, list) or {*map(str, tasks)} != of_frames):
        found.append(f"tasks must be {sorted(of_frames)} (got {tasks})")
    return found


def _is_number(value: Any, *, is_time: bool) -> bool:
    return isinstance(value, int | float if is_time else int) and 0 <= value < math.inf


def _paths(folder: Path, below: str, problems: list[str]) -> list[Path]:
    """Return the files of a table, in the order in which LeRobot reads them."""
    paths = sorted((folder / below).glob("*/*.parquet"))
    if not paths:
        problems.append(f"{folder / below}: has no table (got no file chunk-*/*.parquet)")
    return paths


def _read(path: Path, problems: list[str]) -> Any:
    """Return a table; None, with a problem, if it cannot be read."""
    try:
        table = parquet.ParquetFile(path).read()
    except (OSError, ValueError, NotImplementedError) as error:
        problems.append(f"{path}: {unreadable(error)}")
        return None
    if len({*table.column_names}) < table.num_columns:
        problems.append(f"{path}: a column stands there once (got {', '.join(table.column_names)})")
        return None
    return table
