"""Films of an episode under way: the pictures of its cameras are encoded frame by frame, while the run goes on."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cellwright.recording.dataset.episode import Film
from cellwright.recording.dataset.statistics import PictureStatistics
from cellwright.recording.dataset.video import Clip
from cellwright.util.errors import UsageError


class Films:
    """Films of the cameras of one episode; needs `cellwright[video]`.

    Args:
        source: name of the recording, for errors.
        cameras: names of the cameras.
        rate: pictures in a second [Hz].

    Example:
        >>> films = Films("run.mcap", ["wrist"], 20)
        >>> films.add({"wrist": np.zeros((64, 96, 3), np.uint8)})
        >>> [(film.camera, film.width, film.frames) for film in films.finish()]
        [('wrist', 96, 1)]
    """

    def __init__(self, source: str, cameras: Sequence[str], rate: int) -> None:
        self._source, self._rate = source, rate
        self._clips: dict[str, Clip | None] = dict.fromkeys(cameras)
        self._seen = {camera: PictureStatistics() for camera in cameras}

    def add(self, pictures: Mapping[str, NDArray[np.uint8]]) -> None:
        """Add the pictures of the next frame.

        Args:
            pictures: (height, width, 3) sRGB of each camera, by its name.

        Raises:
            UsageError: a size is odd, or other than before.
            CellwrightError: the pictures cannot be encoded.
        """
        for camera, clip in self._clips.items():
            picture = pictures[camera]
            height, width, _ = picture.shape
            if clip is None:
                clip = self._clips[camera] = self._begun(camera, width, height)
            if (width, height) != (clip.width, clip.height):
                text = f"got {width} x {height}, before {clip.width} x {clip.height} pixels"
                raise UsageError(f"{self._source}: camera {camera}: all its pictures have one size ({text})")
            clip.add(picture)
            self._seen[camera].add(picture)

    def finish(self) -> tuple[Film, ...]:
        """Encode the remaining pictures, and return the film of each camera that has any."""
        return tuple(
            Film(camera, clip.width, clip.height, clip.frames, clip.finish(), self._seen[camera])
            for camera, clip in self._clips.items()
            if clip is not None
        )

    def _begun(self, camera: str, width: int, height: int) -> Clip:
        if width % 2 or height % 2:
            place, text = f"{self._source}: camera {camera}", f"{width} x {height} pixels"
            raise UsageError(f"{place}: width and height must be even for a video (got {text}); change the camera")
        return Clip(width, height, self._rate)
