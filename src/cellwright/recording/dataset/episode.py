"""Episodes of a data set: columns of values at one rate, and the films of its cameras beside them."""

import io
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.recording.dataset.statistics import PictureStatistics
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.files import atomic_file
from cellwright.util.plugins import is_installed

FACTS = ("source", "sha256", "robot", "sentence", "rate", "is_success", "begin")
"""Attributes of an episode beside its columns and films."""

_PNG_LEVEL = 1  # a higher one takes several times as long, and saves a tenth


@dataclass(frozen=True, slots=True)
class Column:
    """Values of one feature: one row for each frame.

    Attributes:
        name: name of the feature, as LeRobot has it: `observation.state`, `action`, `next.reward`, ….
        values: (frames, n) float32, or (frames,) float32 or bool for a scalar. Pictures of `Recording.dataset` are
            (frames, height, width, 3) uint8, sRGB.
        names: names of the n values; empty for a scalar and for pictures.
        units: units of the n values, `rad`, `m` or nothing; empty where none is known, as in a bag of ROS.

    Example:
        >>> Column("next.done", np.array([False, True]), ()).values.shape
        (2,)
    """

    name: str
    values: NDArray[Any]
    names: tuple[str, ...]
    units: tuple[str, ...] = ()


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
        sentence: the task in words; empty if there is none.
        rate: frames in a second [Hz].
        columns: the features, all with the same number of frames.
        films: the pictures of each frame, by camera.
        is_success: True if the run has succeeded.
        begin: simulation time of the first frame [s]; of a bag, the time of its clock.
        sha256: of the recording, as sha256sum prints it; empty if there is none.

    Example:
        >>> state = Column("observation.state", np.array([[0.1], [0.2]], np.float32), ("elbow",), ("rad",))
        >>> episode = Episode("run.mcap", "cellwright_ur10", "Pick.", 20, (state,), (), True)
        >>> episode.time.tolist(), episode.column("observation.state").values.shape
        ([0.0, 0.05], (2, 1))
        >>> episode.to_parquet("episode.parquet")
        >>> from pyarrow import parquet
        >>> parquet.read_table("episode.parquet").column_names
        ['time', 'observation.state.elbow']
    """

    source: str
    robot: str
    sentence: str
    rate: int
    columns: tuple[Column, ...]
    films: tuple[Film, ...]
    is_success: bool
    begin: float = 0.0
    sha256: str = ""

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras of its films."""
        return tuple(film.camera for film in self.films)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.columns[0].values) if self.columns else 0

    @property
    def time(self) -> NDArray[np.float64]:
        """Simulation time of the begin of each frame [s], (frames,)."""
        return self.begin + np.arange(self.frames) / self.rate

    def column(self, name: str) -> Column:
        """Return a column by its name.

        Raises:
            UnknownNameError: there is no such column.
        """
        found = {each.name: each for each in self.columns}
        if name not in found:
            raise UnknownNameError("column", name, found)
        return found[name]

    def to_parquet(self, path: str | Path) -> None:
        """Write the columns as a Parquet table with a row for each frame, for pandas, Polars and DuckDB.

        `time` [s] comes first. Each value has a column of its own, such as `action.elbow_joint`, with the unit in the
        metadata of the field. Pictures are PNG files; films are left out. The other attributes are JSON in the
        metadata of the table, under `cellwright.episode`.

        Args:
            path: the file; a file that is there is replaced.

        Raises:
            UsageError: the package pyarrow is missing.
            OSError: the file cannot be written.
        """
        if not is_installed("pyarrow"):
            raise UsageError(f"{path}: a table needs the package pyarrow; pip install 'cellwright[parquet]'")
        import pyarrow
        from pyarrow import parquet

        found = [*self._flat()]
        fields = [
            pyarrow.field(name, each.type, metadata={"unit": unit} if unit else None) for name, each, unit in found
        ]
        facts = json.dumps({name: getattr(self, name) for name in FACTS})
        schema = pyarrow.schema(fields, {"cellwright.episode": facts})
        with atomic_file(Path(path)) as file:
            parquet.write_table(pyarrow.table([each for _, each, _ in found], schema=schema), file, compression="zstd")

    def _flat(self) -> Iterator[tuple[str, Any, str]]:
        """Yield name, values and unit of each column of the table."""
        from pyarrow import array

        yield "time", array(self.time), "s"
        for column in self.columns:
            if column.values.ndim > 2:
                yield column.name, array([_png(picture) for picture in column.values]), ""
            elif column.values.ndim == 1:
                yield column.name, array(column.values), ""
            else:
                units = column.units or [""] * len(column.names)
                for name, unit, values in zip(column.names, units, column.values.T, strict=True):
                    yield f"{column.name}.{name}", array(np.ascontiguousarray(values)), unit


def _png(picture: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG", compress_level=_PNG_LEVEL)
    return content.getvalue()
