"""Video of a scene, drawn and written by another process."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from typing import TypeAlias

from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import LAMP, PictureRequest
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.video_options import RATE, VideoOptions, check_video_size
from cellwright.rendering.video_pace import VideoPace
from cellwright.rendering.video_size import ChosenQuality, FrameQuality, choose_quality, smallest_quality
from cellwright.rendering.worker import RenderingError, RenderWorker
from cellwright.util.pose import Vector3

_WAITING = 6  # frames that may wait for drawing
_MAX_CAPTION = 300  # characters
_USUAL, _FINE = 2, 4  # samples along each side of a pixel


VideoFigures: TypeAlias = dict[str, float | str]
"""Figures of a video: `file`, `length` [s], `frames`, and `dropped`, the count of frames that were not drawn."""


class Video:
    """Writer of a video.

    A process of its own draws the frames, while the caller goes on. The file is playable however either process ends.
    The same frames give the same pictures on the same machine.

    Args:
        options: file, size and quality.
        scene: the scene to show.
        frame: a frame of it, such as the first; without a size in the options, it is drawn to choose one.
        camera: the camera of that frame.
        lamp: position of the light [m], from the point that the camera looks at, along the world's axes.
        warn: receives a line if there is no OpenGL.

    Attributes:
        options: those given, with the size.

    Raises:
        UsageError: no video can have this size.
        RenderingError: the file cannot be written.
    """

    def __init__(
        self,
        options: VideoOptions,
        scene: Scene,
        frame: SceneFrame,
        camera: Camera,
        *,
        lamp: Vector3 = LAMP,
        warn: Callable[[str], None] = lambda _line: None,
    ) -> None:
        if options.size is not None:
            check_video_size(*options.size)
        self.file = file = options.file
        self.taken = 0
        """Count of the frames taken."""
        self.dropped = 0
        """Count of the frames dropped since others still waited; the previous one is shown longer instead."""
        self.error = ""
        """Reason why it ended early; empty otherwise."""
        self.pace: VideoPace | None = None
        """Counts the frames, if set."""
        self._lamp = lamp
        self._worker = RenderWorker(scene, max_pending=_WAITING)
        self._repeats = 0
        self._waiting: deque[Future[None]] = deque()
        try:
            draws_with = self._worker.ready.result()
            chosen = self._chosen(options, frame, camera, draws_with)
            self.options, self._quality = replace(options, size=chosen.quality.size), chosen.quality
            self._worker.ask("film", file.absolute(), *chosen.quality.size, RATE).result()
        except RenderingError:
            self._worker.close()
            raise
        if draws_with == RAYS:
            warn(f"{file}: OpenGL is not available, so each picture of the video takes seconds; see docs/video.md")
        self.choice = f"{file}: {chosen.reason}; --video-size sets another" if chosen.reason else ""
        """Line for people about a size that was chosen and is not the default; empty otherwise."""

    @property
    def made(self) -> VideoFigures:
        """Figures of the video so far."""
        frames = self.taken + self.dropped
        return {"file": str(self.file), "length": float(frames / RATE), "frames": frames, "dropped": self.dropped}

    def take(self, frame: SceneFrame, camera: Camera, caption: str = "", *, waits: bool = True) -> bool:
        """Add a frame to the video; return whether it was added. A video that has ended takes no more.

        Args:
            frame: poses of the bodies.
            camera: the camera.
            caption: line of text in a corner.
            waits: wait if many frames are in the queue; else the frame is dropped, and counted.
        """
        self._look_back()
        if self.error:
            return False
        if waits:
            self._worker.wait_for_room()
        elif self.taken and not self._worker.has_room:
            self.dropped += 1
            if self.pace is not None:
                self.pace.count_dropped()
            self._repeats += 1
            return False
        request = self._request(camera, self._quality)
        self._waiting.append(self._worker.ask("take", frame, request, caption[:_MAX_CAPTION], self._repeats))
        self.taken += 1
        self._repeats = 0
        return True

    def close(self) -> None:
        """Draw the remaining frames, and finish the file.

        Raises:
            RenderingError: a frame could not be drawn, or the file could not be written.
        """
        try:
            self._worker.ask("finish", self._repeats).result()
            self._look_back()
        finally:
            self._worker.close()
        if self.error:
            raise RenderingError(self.error)

    def _chosen(self, options: VideoOptions, frame: SceneFrame, camera: Camera, draws_with: str) -> ChosenQuality:
        """Return the quality of the frames: as requested, or by drawing some."""
        if options.size is not None:
            return ChosenQuality(FrameQuality(options.size, _FINE if options.fine else _USUAL), "")
        if draws_with == RAYS:
            return smallest_quality("there is no OpenGL here")
        return choose_quality(
            lambda quality: self._worker.colour(frame, self._request(camera, quality)).result(),
            samples=_FINE if options.fine else 0,
        )

    def _request(self, camera: Camera, quality: FrameQuality) -> PictureRequest:
        return PictureRequest(camera, *quality.size, samples=quality.samples, lamp=self._lamp)

    def _look_back(self) -> None:
        """Collect the results of earlier frames."""
        while self._waiting and self._waiting[0].done() and not self.error:
            try:
                self._waiting.popleft().result()
                if self.pace is not None:
                    self.pace.count_drawn()
            except RenderingError as error:
                self.error = str(error)
