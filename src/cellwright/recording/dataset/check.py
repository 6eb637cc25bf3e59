"""Check of a LeRobotDataset v3.0, for the faults that LeRobot reads without a word as well as those that it refuses."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.recording.dataset.check_rows import check_rows
from cellwright.recording.dataset.check_videos import check_videos
from cellwright.recording.dataset.described import Description, read_description, read_mapping
from cellwright.recording.dataset.layout import STATISTICS, STATS

_TOLERANCE = 1e-4  # relative: LeRobot's own writer sums float32


def check_lerobot(folder: str | Path) -> list[str]:
    """Return what is wrong with a data set, as lines `path: what is wrong (got X)`; empty if nothing is.

    The check covers versions, totals, types, order of rows, times, sentences and statistics; of videos, the number,
    times, size and rate of all pictures. Whether a picture belongs to its frame, a check sees only by a mark in it.
    Needs `cellwright[parquet,video]`.

    Args:
        folder: of the set, by `write_lerobot` or any other writer.

    Example:
        >>> check_lerobot("no-such-set")
        ['no-such-set/meta/info.json: cannot be read: No such file or directory']
    """
    problems: list[str] = []
    described = read_description(Path(folder), problems)
    if described is not None:
        rows = check_rows(described, problems)
        check_videos(described, rows.episodes, problems)
        _check_statistics(described, rows.columns, problems)
    return problems


def _check_statistics(described: Description, columns: dict[str, NDArray[Any]], problems: list[str]) -> None:
    """Append what is wrong with the statistics of a set; those of columns are compared with their values."""
    path = described.folder / STATS
    statistics = read_mapping(path, problems)
    if statistics is None:
        return
    for name, feature in {**described.columns, **described.videos}.items():
        if feature.dtype == "string":
            continue
        given = statistics.get(name)
        if not isinstance(given, dict):
            problems.append(f"{path}: {name}: is missing")
            continue
        width = (3, 1, 1) if feature.dtype in ("image", "video") else feature.shape
        for statistic in STATISTICS:
            expected = (1,) if statistic == "count" else width
            if wrong := _wrong_shape(given.get(statistic), expected):
                problems.append(f"{path}: {name}: {statistic}: {wrong}")
                break
        else:
            if name in columns:
                problems += [f"{path}: {name}: {text}" for text in _wrong_figures(given, columns[name])]


def _wrong_shape(value: Any, shape: tuple[int, ...]) -> str:
    if value is None:
        return "is missing"
    try:
        array = np.array(value, np.float64)
    except (TypeError, ValueError):
        return "must be a list of numbers"
    if array.shape != shape:
        return f"must have the shape {shape} (got {array.shape})"
    return "" if np.isfinite(array).all() else "must be finite"


def _wrong_figures(given: dict[str, Any], values: NDArray[Any]) -> list[str]:
    """Compare count, range and mean with the values, (frames, n)."""
    rows = values.reshape(len(values), -1).astype(np.float64)
    scale = float(np.abs(rows).max()) or 1.0
    true: dict[str, Any] = {
        "min": rows.min(axis=0),
        "max": rows.max(axis=0),
        "mean": rows.mean(axis=0),
        "count": [len(rows)],
    }
    found = []
    for statistic, expected in true.items():
        value = np.array(given[statistic], np.float64).ravel()
        tolerance = 0.0 if statistic == "count" else _TOLERANCE * scale
        wrong = np.flatnonzero(np.abs(value - np.array(expected)) > tolerance)
        if wrong.size:
            found.append(f"{statistic}: must be {float(expected[wrong[0]]):.6g} (got {value[wrong[0]]:.6g})")
    return found
