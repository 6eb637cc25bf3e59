"""Description of a data set: `info.json`, read and checked."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellwright.recording.dataset.layout import DATA_PATH, FRAME_COLUMNS, INFO, VERSION, VIDEO_PATH
from cellwright.util.errors import did_you_mean

_NUMBERS = ("float32", "float64", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
_TYPES = (*_NUMBERS, "bool", "string", "image", "video")
_COUNTS = ("total_episodes", "total_frames", "total_tasks")


@dataclass(frozen=True, slots=True)
class Feature:
    """Feature of a data set.

    Attributes:
        dtype: type of a value, `image` or `video`.
        shape: its dimensions; `(1,)` is a scalar.
    """

    dtype: str
    shape: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Description:
    """Contents of `info.json`.

    Attributes:
        folder: of the set.
        rate: frames per second [Hz].
        columns: features with a column in the tables of frames, by name.
        videos: features with videos, by name.
        episodes: number of episodes.
        frames: number of frames.
        tasks: number of sentences.
    """

    folder: Path
    rate: int
    columns: dict[str, Feature]
    videos: dict[str, Feature]
    episodes: int
    frames: int
    tasks: int


def read_description(folder: Path, problems: list[str]) -> Description | None:
    """Read the description of a set, and append what is wrong with it; None if the set cannot be judged by it."""
    path = folder / INFO
    info = read_mapping(path, problems)
    if info is None:
        return None
    before = len(problems)
    problems += [f"{path}: {text}" for text in _wrong_values(info)]
    features = info.get("features")
    if len(problems) > before or not isinstance(features, dict):
        return None
    problems += [f"{path}: features: {name}: {text}" for name, each in features.items() for text in _wrong(name, each)]
    problems += [f"{path}: features: {name}: is missing" for name in FRAME_COLUMNS if name not in features]
    if len(problems) > before:
        return None
    read = {name: Feature(each["dtype"], tuple(each["shape"])) for name, each in features.items()}
    return Description(
        folder=folder,
        rate=info["fps"],
        columns={name: each for name, each in read.items() if each.dtype != "video"},
        videos={name: each for name, each in read.items() if each.dtype == "video"},
        episodes=info["total_episodes"],
        frames=info["total_frames"],
        tasks=info["total_tasks"],
    )


def read_mapping(path: Path, problems: list[str]) -> dict[str, Any] | None:
    """Return the mapping in a JSON file; None, with a problem, if there is none."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        problems.append(f"{path}: {unreadable(error)}")
        return None
    if isinstance(found, dict):
        return found
    problems.append(f"{path}: is not a mapping (got {type(found).__name__})")
    return None


def unreadable(error: Exception) -> str:
    """Return why a file of a set cannot be read."""
    return f"cannot be read: {getattr(error, 'strerror', None) or error}"


def _wrong_values(info: dict[str, Any]) -> list[str]:
    found = []
    if info.get("codebase_version") != VERSION:
        found.append(f"codebase_version: must be {VERSION!r} (got {info.get('codebase_version')!r})")
    if not isinstance(info.get("features"), dict):
        found.append(f"features: must be a mapping (got {type(info.get('features')).__name__})")
    found += [
        f"{name}: must be a whole number over 0 (got {info.get(name)!r})"
        for name in ("fps", *_COUNTS)
        if not _is_whole(info.get(name))
    ]
    for name, expected in (("data_path", DATA_PATH), ("video_path", VIDEO_PATH)):
        if info.get(name) not in (None, expected):
            found.append(f"{name}: must be {expected!r} (got {info[name]!r})")
    return found


def _wrong(name: str, feature: Any) -> list[str]:
    if not isinstance(feature, dict):
        return [f"must be a mapping (got {type(feature).__name__})"]
    dtype, shape, names = (feature.get(key) for key in ("dtype", "shape", "names"))
    found = []
    if "/" in name:
        found.append("a name has no slash")
    if dtype not in _TYPES:
        found.append(f"dtype: unknown (got {dtype!r}){did_you_mean(str(dtype), _TYPES)}")
    if not isinstance(shape, list) or not shape or not all(_is_whole(each) for each in shape):
        return [*found, f"shape: must be a list of whole numbers over 0 (got {shape!r})"]
    if name in FRAME_COLUMNS and (dtype, shape) != (FRAME_COLUMNS[name], [1]):
        found.append(f"must be {FRAME_COLUMNS[name]} of shape [1] (got {dtype} of {shape})")
    if dtype == "video" and (len(shape) != 3 or shape[0] % 2 or shape[1] % 2):
        found.append(f"shape: must be height, width and channels, both even (got {shape})")
    if "names" not in feature:
        found.append("names: is missing")
    elif isinstance(names, list) and len(names) != (3 if dtype in ("video", "image") else shape[0]):
        found.append(f"names: one for each value (got {len(names)} for shape {shape})")
    return found


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value > 0
