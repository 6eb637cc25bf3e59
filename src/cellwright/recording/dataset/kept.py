"""Finished episodes on disk: an export that was killed goes on from them."""

import hashlib
import json
import zipfile
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from cellwright._package import VERSION
from cellwright.recording.dataset.digest import sha256_of
from cellwright.recording.dataset.episode import FACTS, Column, Episode, Film
from cellwright.recording.dataset.statistics import PictureStatistics
from cellwright.util.files import atomic_file, open_to_read

_FORM = 2
_PACKAGES = ("numpy", "av", "mujoco-core")  # another version may give other bytes
_HEAD = "head"


def kept_episode(folder: Path, recording: Path, settings: dict[str, Any], make: Callable[[], Episode]) -> Episode:
    """Return the episode of a recording: as it was kept, or else made, and kept under a name of all it depends on.

    Args:
        folder: folder of the kept episodes, of the user's own; it is created for the first one.
        recording: the file, or the folder of a bag; its name and its bytes count.
        settings: options that the episode depends on, as JSON values.
        make: makes the episode.

    Raises:
        OSError: the recording cannot be read, or the episode cannot be kept.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> done = Column("next.done", np.array([False, True]), ())
        >>> make = lambda: Episode("run.mcap", "cellwright_ur10", "Pick.", 20, (done,), (), True)
        >>> with TemporaryDirectory() as name:
        ...     folder, recording = Path(name) / "kept", Path(name) / "run.mcap"
        ...     size = recording.write_bytes(b"its bytes")
        ...     made = kept_episode(folder, recording, {"hz": 20}, make)
        ...     again = kept_episode(folder, recording, {"hz": 20}, lambda: None)  # it is not made again
        >>> again.robot, again.columns[0].values.tolist()
        ('cellwright_ur10', [False, True])
    """
    path = folder / f"{_key(recording, settings)}.npz"
    found = _read(path)
    if found is None:
        found = make()
        folder.mkdir(parents=True, exist_ok=True)
        _write(path, found)
    return found


def _key(recording: Path, settings: dict[str, Any]) -> str:
    packages = {name: _version(name) for name in _PACKAGES}
    facts = [_FORM, VERSION, packages, recording.name, sha256_of(recording), settings]
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _write(path: Path, episode: Episode) -> None:
    head = {
        "facts": {name: getattr(episode, name) for name in FACTS},
        "columns": [[column.name, column.names, column.units] for column in episode.columns],
        "films": [[film.camera, film.width, film.height, film.frames] for film in episode.films],
    }
    arrays: dict[str, Any] = {_HEAD: np.frombuffer(json.dumps(head).encode(), np.uint8)}
    arrays |= {f"column{number}": column.values for number, column in enumerate(episode.columns)}
    for number, film in enumerate(episode.films):
        arrays[f"video{number}"] = np.frombuffer(film.video, np.uint8)
        arrays[f"counts{number}"] = film.statistics.counts
    with atomic_file(path) as file:
        np.savez(file, **arrays)


def _read(path: Path) -> Episode | None:
    """Return a kept episode; None if there is none, or its file is damaged."""
    try:
        with open_to_read(path) as file, np.load(file, allow_pickle=False) as arrays:
            head = json.loads(arrays[_HEAD].tobytes())
            columns = tuple(
                Column(name, arrays[f"column{number}"], tuple(names), tuple(units))
                for number, (name, names, units) in enumerate(head["columns"])
            )
            films = tuple(
                Film(camera, width, height, frames, arrays[f"video{number}"].tobytes(), seen)
                for number, (camera, width, height, frames) in enumerate(head["films"])
                for seen in [PictureStatistics(arrays[f"counts{number}"], frames)]
            )
            return Episode(columns=columns, films=films, **head["facts"])
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None
