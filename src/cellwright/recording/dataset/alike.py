"""Requirements on the episodes of one data set: each is valid, and all have the same form."""

from typing import Any

import numpy as np

from cellwright.recording.dataset.episode import Column, Episode, Film
from cellwright.recording.dataset.layout import FRAME_COLUMNS, picture_key
from cellwright.util.errors import UsageError

_TYPES = ("float32", "bool")


def require_valid(episode: Episode) -> None:
    """Require of an episode what a data set takes.

    Raises:
        UsageError: it has no frames, or columns or films of different lengths; a value is not finite; a type is neither
            float32 nor bool; a name is none for a set. The text names the recording.
    """
    names = [*(column.name for column in episode.columns), *map(picture_key, episode.cameras)]
    for name in names:
        if "/" in name:
            raise UsageError(f"{episode.source}: {name}: a name in a data set has no slash; name it otherwise")
        if name in FRAME_COLUMNS or names.count(name) > 1:
            raise UsageError(f"{episode.source}: {name}: the data set has a column of this name; name it otherwise")
    if not episode.columns or not len(episode.columns[0].values):
        raise UsageError(f"{episode.source}: has no frame; leave it out")
    for column in episode.columns:
        if wrong := _wrong(column, len(episode.columns[0].values)):
            raise UsageError(f"{episode.source}: {column.name}: {wrong}")
    frames = len(episode.columns[0].values)
    for film in episode.films:
        if film.frames != frames:
            text = f"one picture per frame (got {film.frames} for {frames})"
            raise UsageError(f"{episode.source}: camera {film.camera}: {text}")


def require_alike(episode: Episode, first: Episode) -> None:
    """Require that an episode has the robot, rate, columns and films of the form of the first one of its set.

    Raises:
        UsageError: something differs; the text names both recordings and what differs.
    """
    pairs: list[tuple[str, Any, Any]] = [
        ("robot", episode.robot, first.robot),
        ("rate", f"{episode.rate} Hz", f"{first.rate} Hz"),
        ("cameras", _listed(episode.cameras), _listed(first.cameras)),
        ("columns", _listed(each.name for each in episode.columns), _listed(each.name for each in first.columns)),
    ]
    if pairs[-1][1] == pairs[-1][2]:
        both = zip(episode.columns, first.columns, strict=True)
        pairs += [(f"column {one.name}", _form(one), _form(other)) for one, other in both]
    if episode.cameras == first.cameras:
        films = zip(episode.films, first.films, strict=True)
        pairs += [(f"camera {one.camera}", _size(one), _size(other)) for one, other in films]
    for name, value, expected in pairs:
        if value != expected:
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


def _form(column: Column) -> str:
    return f"{column.values.dtype} {_listed(column.names)}"


def _size(film: Film) -> str:
    return f"{film.width} x {film.height} pixels"


def _listed(names: Any) -> str:
    return ", ".join(names) or "none"
