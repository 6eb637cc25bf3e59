"""Episodes of a data set: columns of values at one rate, and the pictures beside them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Column:
    """Values of one feature: one row for each frame.

    Attributes:
        name: name of the feature, as LeRobot has it: `observation.state`, `action`, `next.reward`, ….
        values: (frames, n) float32, or (frames,) float32 or bool for a scalar.
        names: names of the n values; empty for a scalar.

    Example:
        >>> Column("next.done", np.array([False, True]), ()).values.shape
        (2,)
    """

    name: str
    values: NDArray[Any]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Episode:
    """One run at one rate, with what was seen and what was executed.

    Attributes:
        source: name of the recording.
        robot: kind of the robot, such as `cellwright_ur10`.
        sentence: the task in words.
        rate: frames in a second [Hz].
        columns: the features, all with the same number of frames.
        cameras: names of the cameras of its pictures.
        pictures: draws them again: yields a dictionary for each frame, in order, with a picture (height, width, 3) by
            the name of its camera.
        is_success: True if the run has succeeded.

    Example:
        >>> done = Column("next.done", np.array([False, True]), ())
        >>> episode = Episode("run.mcap", "cellwright_ur10", "Pick.", 20, (done,), (), lambda: iter([{}, {}]), True)
        >>> len(episode.columns[0].values)
        2
    """

    source: str
    robot: str
    sentence: str
    rate: int
    columns: tuple[Column, ...]
    cameras: tuple[str, ...]
    pictures: Callable[[], Iterator[dict[str, NDArray[np.uint8]]]]
    is_success: bool
