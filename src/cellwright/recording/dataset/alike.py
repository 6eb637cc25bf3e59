"""Requirements on the episodes of one data set: each is valid, and all have the same form."""

from collections.abc import Iterable

import numpy as np

from cellwright.recording.dataset.episode import Column, Episode
from cellwright.recording.dataset.layout import FRAME_COLUMNS, picture_key
from cellwright.util.errors import UsageError

_TYPES = ("float32", "bool")


def require_valid(episode: Episode) -> None:
    """Require of an episode what a data set takes.

    Raises:
        UsageError: it has no frames or no sentence, or columns or films of different lengths; a value is not finite; a
            type is neither float32 nor bool; a name is none for a set. The text names the recording.
    """
    names = [*(column.name for column in episode.columns), *map(picture_key, episode.cameras)]
    for name in names:
        if "/" in name:
            raise UsageError(f"{episode.source}: {name}: a name in a data set has no slash; name it otherwise")
        if name in FRAME_COLUMNS or names.count(name) > 1:
            raise UsageError(f"{episode.source}: {name}: the data set has a column of this name; name it otherwise")
    if not episode.frames:
        raise UsageError(f"{episode.source}: has no frame; leave it out")
    if not episode.sentence:
        raise UsageError(f"{episode.source}: sentence: is empty; give the task in words")
    for column in episode.columns:
        if wrong := _wrong(column, episode.frames):
            raise UsageError(f"{episode.source}: {column.name}: {wrong}")
    for film in episode.films:
        if film.frames != episode.frames:
            text = f"one picture per frame (got {film.frames} for {episode.frames})"
            raise UsageError(f"{episode.source}: camera {film.camera}: {text}")


def require_alike(episode: Episode, first: Episode) -> None:
    """Require that an episode has the robot, rate, columns and films of the form of the first one of its set.

    Raises:
        UsageError: something differs; the text names both recordings and what differs.
    """
    form = _form(first)
    for name, value in _form(episode).items():
        if value != (expected := form[name]):  # the names of columns and cameras are equal by then
            text = f"{name}: other than in {first.source}, {expected} (got {value})"
            raise UsageError(f"{episode.source}: {text}; put it into a data set of its own")


def _wrong(column: Column, frames: int) -> str:
    values = column.values
    if len(values) != frames:
        return f"all columns have the same number of frames (got {len(values)}, not {frames})"
    if str(values.dtype) not in _TYPES:
        return f"values are of float32 or bool (got {values.dtype})"
    width = values.shape[1] if values.ndim == 2 else 0
    if values.ndim > 2 or width != len(column.names):
        got = f"{values.shape}, {len(column.names)} names"
        return f"one name for each value of a row, and none for a scalar (got {got})"
    if not np.isfinite(values).all():
        return f"values are finite (got {values[~np.isfinite(values)][0]})"
    return ""


def _form(episode: Episode) -> dict[str, str]:
    """Return what all episodes of a set have in common, in words, by its name."""
    return {
        "robot": episode.robot,
        "rate": f"{episode.rate} Hz",
        "cameras": _listed(episode.cameras),
        "columns": _listed(column.name for column in episode.columns),
        **{f"column {each.name}": f"{each.values.dtype} {_listed(each.names)}" for each in episode.columns},
        **{f"camera {each.camera}": f"{each.width} x {each.height} pixels" for each in episode.films},
    }


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
