"""Writer of LeRobotDataset v3.0, which LeRobot's training and its tools read."""

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.recording.dataset.alike import require_alike, require_valid
from cellwright.recording.dataset.card import card
from cellwright.recording.dataset.episode import Episode
from cellwright.recording.dataset.layout import (
    DATA_PATH,
    FILES_IN_CHUNK,
    FRAME_COLUMNS,
    INFO,
    MAX_DATA_MB,
    MAX_VIDEO_MB,
    RECORDING_COLUMNS,
    STATS,
    VERSION,
    VIDEO_PATH,
    picture_key,
)
from cellwright.recording.dataset.statistics import PictureStatistics, column_statistics
from cellwright.recording.dataset.tables import DataFiles, write_episodes, write_tasks
from cellwright.recording.dataset.video import CameraVideos, video_feature
from cellwright.util.errors import UsageError


def write_lerobot(
    folder: str | Path,
    episodes: Iterable[Episode],
    on_progress: Callable[[int, int], None] = lambda _episodes, _frames: None,
    *,
    beside: Path | None = None,
) -> None:
    """Write episodes as a LeRobotDataset v3.0, whole or not at all.

    Equal episodes give equal bytes with the same versions of pyarrow and av. Statistics are exact, over all frames and
    pixels. The set grows in a hidden folder, which a killed program leaves behind; another call begins from the start.
    Needs `cellwright[parquet,video]`.

    Args:
        folder: the new folder of the set.
        episodes: all with the same robot, rate, columns and cameras; taken one after the other.
        on_progress: takes the number of episodes and of frames so far, after each episode.
        beside: folder in which the set grows, on the same file system, created if needed; None for that of `folder`.

    Raises:
        UsageError: the folder exists, there is no episode, or an episode cannot stand beside the first; the text names
            its recording.
        OSError: the set cannot be written.

    Example:
        >>> from cellwright.recording.dataset.episode import Column, Episode
        >>> action = Column("action", np.zeros((3, 2), np.float32), ("shoulder", "elbow"))
        >>> episode = Episode("run.mcap", "cellwright_ur10", "Pick it.", 20, (action,), (), True)
        >>> write_lerobot("picks", [episode])
        >>> sorted(path.name for path in Path("picks/meta").iterdir())
        ['episodes', 'info.json', 'stats.json', 'tasks.parquet']
    """
    folder = Path(folder)
    if os.path.lexists(folder):
        raise UsageError(f"{folder}: exists already; name another folder, or remove this one")
    place = folder.parent if beside is None else beside
    for needed in (folder.parent, place):
        needed.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=place, prefix=f".{folder.name}-", suffix=".part") as temporary:
        unfinished = Path(temporary) / "set"
        unfinished.mkdir()
        written = _Set(unfinished)
        for episode in episodes:
            written.add(episode)
            on_progress(len(written.rows), written.frames)
        if not written.rows:
            raise UsageError(f"{folder}: there is no episode to write; give at least one")
        written.finish()
        unfinished.rename(folder)


class _Set:
    """Data set under way."""

    def __init__(self, folder: Path) -> None:
        self.rows: list[dict[str, Any]] = []
        self.frames = 0
        self._folder = folder
        self._data = DataFiles(folder)
        self._episodes: list[Episode] = []  # without videos; the columns are kept for the exact statistics of all
        self._numbers: list[dict[str, NDArray[Any]]] = []
        self._videos: dict[str, CameraVideos] = {}
        self._seen: dict[str, PictureStatistics] = {}
        self._sentences: dict[str, int] = {}

    def add(self, episode: Episode) -> None:
        """Add an episode, with its films.

        Raises:
            UsageError: it is not valid, or differs from the first one.
        """
        require_valid(episode)
        if self._episodes:
            require_alike(episode, self._episodes[0])
        columns, count = self._columns(episode), episode.frames
        statistics = {name: column_statistics(values) for name, values in columns.items()}
        row: dict[str, Any] = {"episode_index": len(self.rows), "tasks": [episode.sentence], "length": count}
        row |= zip(RECORDING_COLUMNS, (episode.source, episode.sha256), strict=True)
        row |= self._data.append(columns)
        row |= {"dataset_from_index": self.frames, "dataset_to_index": self.frames + count}
        for film in episode.films:
            key = picture_key(film.camera)
            row |= self._videos.setdefault(key, CameraVideos(self._folder, key, episode.rate)).append(film.video)
            self._seen.setdefault(key, PictureStatistics()).include(film.statistics)
            statistics[key] = film.statistics.as_lists()
        for feature, figures in statistics.items():
            row |= {f"stats/{feature}/{name}": values for name, values in figures.items()}
        self.rows.append(row)
        self._episodes.append(replace(episode, films=tuple(replace(film, video=b"") for film in episode.films)))
        self._numbers.append(columns)
        self.frames += count

    def finish(self) -> None:
        """Write all that needs the last episode, and close the files."""
        self._data.close()
        for videos in self._videos.values():
            videos.close()
        write_episodes(self._folder, self.rows)
        write_tasks(self._folder, [*self._sentences])
        self._write_json(INFO, self._info())
        every = {name: np.concatenate([each[name] for each in self._numbers]) for name in self._numbers[0]}
        statistics: dict[str, Any] = {name: column_statistics(values) for name, values in every.items()}
        self._write_json(STATS, {**statistics, **{key: seen.as_lists() for key, seen in self._seen.items()}})
        (self._folder / "README.md").write_text(card(self._episodes), encoding="utf-8")

    def _columns(self, episode: Episode) -> dict[str, NDArray[Any]]:
        """Return its columns and those that every set has. A vector of one value is a scalar, as LeRobot reads it."""
        task = self._sentences.setdefault(episode.sentence, len(self._sentences))
        frames = np.arange(episode.frames, dtype=np.int64)
        own: dict[str, NDArray[Any]] = {
            "timestamp": (frames / episode.rate).astype(np.float32),
            "frame_index": frames,
            "episode_index": np.full_like(frames, len(self.rows)),
            "index": self.frames + frames,
            "task_index": np.full_like(frames, task),
        }
        given = {each.name: each.values for each in episode.columns}
        return {**{name: values[:, 0] if values.shape[1:] == (1,) else values for name, values in given.items()}, **own}

    def _info(self) -> dict[str, Any]:
        first = self._episodes[0]
        features: dict[str, Any] = {}
        for column in first.columns:
            width = column.values.shape[1] if column.values.ndim == 2 else 1
            names = [*column.names] or None
            features[column.name] = {"dtype": str(column.values.dtype), "shape": [width], "names": names}
        for film in first.films:
            features[picture_key(film.camera)] = video_feature(film.width, film.height, first.rate)
        features |= {name: {"dtype": dtype, "shape": [1], "names": None} for name, dtype in FRAME_COLUMNS.items()}
        return {
            "codebase_version": VERSION,
            "robot_type": first.robot,
            "total_episodes": len(self.rows),
            "total_frames": self.frames,
            "total_tasks": len(self._sentences),
            "chunks_size": FILES_IN_CHUNK,
            "data_files_size_in_mb": MAX_DATA_MB,
            "video_files_size_in_mb": MAX_VIDEO_MB,
            "fps": first.rate,
            "splits": {"train": f"0:{len(self.rows)}"},
            "data_path": DATA_PATH,
            "video_path": VIDEO_PATH if first.cameras else None,
            "features": features,
        }

    def _write_json(self, name: str, value: Any) -> None:
        (self._folder / name).write_text(json.dumps(value, indent=4, ensure_ascii=False), encoding="utf-8")
