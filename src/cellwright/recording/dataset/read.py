"""Reader of a LeRobotDataset v3.0: rows, sentence and pictures of each episode."""

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray

from cellwright.recording.dataset.check_rows import check_rows
from cellwright.recording.dataset.described import read_description, unreadable
from cellwright.recording.dataset.layout import RECORDING_COLUMNS, VIDEO_COLUMNS, VIDEO_PATH
from cellwright.util.errors import UnknownNameError, UsageError

_TOLERANCE = Fraction(1, 10_000)  # [s], that of LeRobot's readers


class DataSet:
    """Data set whose tables have no fault; needs `cellwright[parquet,video]`.

    Args:
        folder: of the set, by `write_lerobot` or any other writer.

    Attributes:
        folder: of the set.
        rate: frames in a second [Hz].
        videos: names of the features that are videos.

    Raises:
        UsageError: the tables have a fault; the text is the first one.

    Example:
        >>> from cellwright.recording.dataset.episode import Column, Episode
        >>> from cellwright.recording.dataset.lerobot import write_lerobot
        >>> action = Column("action", np.ones((3, 2), np.float32), ("shoulder", "elbow"))
        >>> write_lerobot("to-read", [Episode("run.mcap", "cellwright_ur10", "Pick it.", 20, (action,), (), True)])
        >>> read = DataSet("to-read")
        >>> len(read), read.sentence(0), read.columns(0)["action"].shape
        (1, 'Pick it.', (3, 2))
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        problems: list[str] = []
        described = read_description(self.folder, problems)
        rows = None if described is None else check_rows(described, problems)
        if problems or described is None or rows is None:
            raise UsageError(f"{problems[0]}; see cellwright export --check {folder}")
        self.rate, self.videos = described.rate, tuple(described.videos)
        self._rows, self._columns = rows.episodes, rows.columns

    def __len__(self) -> int:
        """Return the number of episodes."""
        return len(self._rows)

    def columns(self, episode: int) -> dict[str, NDArray[Any]]:
        """Return the values of an episode by feature, (frames, n) or (frames,); texts and pictures are left out."""
        row = self._rows[episode]
        return {name: each[row["dataset_from_index"] : row["dataset_to_index"]] for name, each in self._columns.items()}

    def sentence(self, episode: int) -> str:
        """Return the task of an episode in words."""
        return str(self._rows[episode]["tasks"][0])

    def recording(self, episode: int) -> tuple[str, str]:
        """Return the name and the SHA-256 of the recording of an episode; both are empty where the set has none."""
        name, digest = (self._rows[episode].get(each) or "" for each in RECORDING_COLUMNS)
        return str(name), str(digest)

    def pictures(self, episode: int, feature: str) -> Iterator[NDArray[np.uint8]]:
        """Yield the picture of each frame of an episode, (height, width, 3), found by its time.

        Raises:
            UnknownNameError: no feature of this name is a video.
            UsageError: the video cannot be decoded, or lacks the picture of a frame.
        """
        if feature not in self.videos:
            raise UnknownNameError("video feature", feature, self.videos)
        row = self._rows[episode]
        chunk, file, begin, _ = (row[f"videos/{feature}/{name}"] for name in VIDEO_COLUMNS)
        path = self.folder / VIDEO_PATH.format(video_key=feature, chunk_index=chunk, file_index=file)
        first = Fraction(begin)
        wanted = [first + Fraction(frame, self.rate) for frame in range(row["length"])]
        found = 0
        try:
            with av.open(str(path)) as video:
                for time, picture in _decoded(video, first):
                    if found < len(wanted) and abs(time - wanted[found]) <= _TOLERANCE:
                        yield picture
                        found += 1
                    if found == len(wanted):
                        return
        except (av.FFmpegError, OSError, ValueError) as error:
            raise UsageError(f"{path}: {unreadable(error)}") from None
        raise UsageError(
            f"{path}: has no picture at {float(wanted[found]):.4f} s, of frame {found} of episode {episode}"
        )


def _decoded(video: Any, begin: Fraction) -> Iterator[tuple[Fraction, NDArray[np.uint8]]]:
    """Yield times [s] and pictures of a video, from the last whole picture before a time on."""
    stream = video.streams.video[0]
    video.seek(int(begin / stream.time_base), stream=stream)
    for frame in video.decode(stream):
        if frame.pts is not None:
            yield frame.pts * Fraction(stream.time_base), frame.to_ndarray(format="rgb24")
