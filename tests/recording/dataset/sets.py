"""Small data sets: two episodes with pictures that carry the number of their frame as a grey level."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray
from pyarrow import parquet

from cellwright.recording.dataset.episode import Column, Episode
from cellwright.recording.dataset.films import Films
from cellwright.recording.dataset.layout import INFO, picture_key
from cellwright.recording.dataset.lerobot import write_lerobot

RATE = 20
LENGTHS = (12, 9)
CAMERAS = ("top", "side")
SENTENCES = ("Pick the gear.", "Place the part.")
HEIGHT, WIDTH = 64, 96
DATA, EPISODES = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
STEP = 9
"""Grey levels between neighbouring frames, more than the video's losses."""


def grey(episode: int, frame: int, camera: str = "top") -> int:
    """Grey level of all pixels of a picture: rising in even episodes, falling in odd ones."""
    level = 40 + STEP * frame if episode % 2 == 0 else 200 - STEP * frame
    return level + 4 * CAMERAS.index(camera)


def made(number: int = 0, cameras: tuple[str, ...] = ("top",), **changes: Any) -> Episode:
    """An episode by its number; `picture` may be a function of frame and camera, `filmed` their number of frames."""
    frames = changes.pop("frames", LENGTHS[number % 2])
    picture: Callable[[int, str], NDArray[np.uint8]] = changes.pop(
        "picture", lambda frame, camera: np.full((HEIGHT, WIDTH, 3), grey(number, frame, camera), np.uint8)
    )

    films = Films(f"run{number}.mcap", cameras, RATE)
    for frame in range(changes.pop("filmed", frames)):
        films.add({camera: picture(frame, camera) for camera in cameras})
    random = np.random.default_rng(number)
    last = np.arange(frames) == frames - 1
    given: dict[str, Any] = {
        "source": f"run{number}.mcap",
        "robot": "cellwright_ur10",
        "sentence": SENTENCES[number % 2],
        "rate": RATE,
        "columns": (
            Column("observation.state", random.normal(size=(frames, 3)).astype(np.float32), ("a", "b", "c")),
            Column("action", random.normal(size=(frames, 2)).astype(np.float32), ("x", "y"), ("m", "rad")),
            Column("next.reward", last.astype(np.float32), ()),
            Column("next.done", last, ()),
        ),
        "films": films.finish(),
        "is_success": number % 2 == 0,
        "begin": 0.5 * number,
        "sha256": str(number) * 64,
    }
    return Episode(**{**given, **changes})


def write(folder: Path, cameras: tuple[str, ...] = ("top",)) -> Path:
    """Write a good set of two episodes, and return its folder."""
    write_lerobot(folder, [made(0, cameras), made(1, cameras)])
    return folder


def copied(good: Path, folder: Path) -> Path:
    """Copy a good set, to be damaged."""
    shutil.copytree(good, folder)
    return folder


def change_table(path: Path, change: Callable[[Any], Any]) -> None:
    """Write a table again, changed."""
    parquet.write_table(change(parquet.ParquetFile(path).read()), path)


def change_info(folder: Path, **values: Any) -> None:
    """Write `info.json` again with these values; those that are None are left out."""
    info = {**json.loads((folder / INFO).read_text()), **values}
    (folder / INFO).write_text(json.dumps({key: value for key, value in info.items() if value is not None}))


def greys(folder: Path, episode: int, camera: str = "top") -> list[float]:
    """Mean grey level of the picture of each frame of an episode, found as LeRobot finds it: by its time."""
    row = parquet.read_table(folder / EPISODES).to_pylist()[episode]
    times = parquet.read_table(folder / DATA)["timestamp"].to_pylist()
    key = picture_key(camera)
    place = "chunk-{:03d}/file-{:03d}.mp4".format(*(row[f"videos/{key}/{name}_index"] for name in ("chunk", "file")))
    with av.open(str(folder / "videos" / key / place)) as file:
        shown: dict[Any, float] = {
            frame.time: float(frame.to_ndarray(format="rgb24").mean()) for frame in file.decode(video=0)
        }
    begin = row[f"videos/{key}/from_timestamp"]
    found = []
    for time in times[row["dataset_from_index"] : row["dataset_to_index"]]:
        nearest = min(shown, key=lambda at: abs(at - begin - time))
        assert abs(nearest - begin - time) < 1e-4
        found.append(shown[nearest])
    return found
