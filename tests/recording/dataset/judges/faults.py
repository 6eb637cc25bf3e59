"""Faults of data sets, each of which our own check must find; the judges find some of them."""

import json
from collections.abc import Callable
from pathlib import Path

from cellwright.recording.dataset.layout import INFO, STATS, TASKS
from tests.recording.dataset.damage import as_lists, put, reversed_rows, with_another, without
from tests.recording.dataset.sets import DATA, EPISODES, change_info, change_table


def _wider_action(folder: Path) -> None:
    features = json.loads((folder / INFO).read_text())["features"]
    features["action"] |= {"shape": [3], "names": ["x", "y", "z"]}
    change_info(folder, features=features)


def _shifted(folder: Path) -> None:
    for name in ("from", "to"):
        column = f"videos/observation.images.top/{name}_timestamp"
        change_table(folder / EPISODES, put(column, lambda values: [values[0], values[1] - 0.05]))


FAULTS: dict[str, Callable[[Path], None]] = {
    "scalar as a list of one": lambda folder: change_table(folder / DATA, as_lists),
    "column of no feature": lambda folder: change_table(folder / DATA, with_another),
    "frames out of order": lambda folder: change_table(folder / DATA, reversed_rows),
    "episodes out of order": lambda folder: change_table(folder / EPISODES, reversed_rows),
    "sentences out of order": lambda folder: change_table(folder / TASKS, reversed_rows),
    "sentences without index": lambda folder: change_table(
        folder / TASKS, lambda table: table.replace_schema_metadata(None)
    ),
    "total_frames wrong": lambda folder: change_info(folder, total_frames=20),
    "no stats.json": lambda folder: (folder / STATS).unlink(),
    "fps wrong": lambda folder: change_info(folder, fps=12.5),
    "shape of a feature wrong": _wider_action,
    "no timestamp": lambda folder: change_table(folder / DATA, without("timestamp")),
    "video a frame early": _shifted,
}
"""Damage that makes each fault in a good set of `tests.recording.dataset.sets`."""
