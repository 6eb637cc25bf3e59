"""Episodes of a data set: columns of values at one rate, and the films of its cameras beside them."""

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from cellwright.recording.dataset.statistics import PictureStatistics


@dataclass(frozen=True, slots=True)
class Column:
    """Values of one feature: one row for each frame.

    Attributes:
        name: name of the feature, as LeRobot has it: `observation.state`, `action`, `next.reward`, ….
        values: (frames, n) float32, or (frames,) float32 or bool for a scalar.
        names: names of the n values; empty for a scalar.

    Example:
        >>> import numpy as np
        >>> Column("next.done", np.array([False, True]), ()).values.shape
        (2,)
    """

    name: str
    values: NDArray[Any]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Film:
    """Pictures of a camera in one episode, encoded on their own: the bytes depend on these pictures alone.

    Attributes:
        camera: name of the camera.
        width: width of each picture [pixels].
        height: height of each picture [pixels].
        frames: number of its pictures.
        video: AV1 in the bytes of an MP4 file.
        statistics: of all pixels, before the losses of the video.

    Example:
        >>> Film("wrist", 640, 480, 0, b"", PictureStatistics()).frames
        0
    """

    camera: str
    width: int
    height: int
    frames: int
    video: bytes
    statistics: PictureStatistics


@dataclass(frozen=True, slots=True)
class Episode:
    """One run at one rate, with what was seen and what was executed.

    Attributes:
        source: name of the recording.
        robot: kind of the robot, such as `cellwright_ur10`.
        sentence: the task in words.
        rate: frames in a second [Hz].
        columns: the features, all with the same number of frames.
        films: the pictures of each frame, by camera.
        is_success: True if the run has succeeded.

    Example:
        >>> import numpy as np
        >>> done = Column("next.done", np.array([False, True]), ())
        >>> episode = Episode("run.mcap", "cellwright_ur10", "Pick.", 20, (done,), (), True)
        >>> len(episode.columns[0].values)
        2
    """

    source: str
    robot: str
    sentence: str
    rate: int
    columns: tuple[Column, ...]
    films: tuple[Film, ...]
    is_success: bool

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras of its films."""
        return tuple(film.camera for film in self.films)
