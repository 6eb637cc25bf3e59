"""Video of a scene, drawn and written by another process."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeAlias

from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import LAMP, PictureRequest
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.video_options import RATE, VideoOptions, check_video_size
from cellwright.rendering.video_pace import VideoPace
from cellwright.rendering.worker import RenderingError, RenderWorker
from cellwright.util.pose import Vector3

_WAITING = 6  # frames that may wait for drawing
_MAX_CAPTION = 300  # characters


VideoFigures: TypeAlias = dict[str, float | str]
"""Figures of a video: `file`, `length` [s], `frames`, and `dropped`, the count of frames that were not drawn."""


class Video:
    """Writer of a video.

    A process of its own draws the frames, while the caller goes on. The file is playable however either process ends.
    The same frames give the same pictures on the same machine.

    Args:
        options: file, size and quality.
        scene: the scene to show.
        lamp: position of the light [m], from the point that the camera looks at, along the world's axes.
        warn: receives a line if there is no OpenGL.

    Raises:
        UsageError: no video can have this size.
        RenderingError: the file cannot be written.
    """

    def __init__(
        self,
        options: VideoOptions,
        scene: Scene,
        *,
        lamp: Vector3 = LAMP,
        warn: Callable[[str], None] = lambda _line: None,
    ) -> None:
        check_video_size(options.width, options.height)
        self.file = file = options.file
        self.taken = 0
        """Count of the frames taken."""
        self.dropped = 0
        """Count of the frames dropped since others still waited; the previous one is shown longer instead."""
        self.error = ""
        """Reason why it ended early; empty otherwise."""
        self.pace: VideoPace | None = None
        """Counts the frames, if set."""
        self._options, self._lamp = options, lamp
        self._worker = RenderWorker(scene, max_pending=_WAITING)
        self._repeats = 0
        self._waiting: deque[Future[None]] = deque()
        try:
            self._worker.ask("film", file.absolute(), options.width, options.height, RATE).result()
            draws_with = self._worker.ready.result()
        except RenderingError:
            self._worker.close()
            raise
        if draws_with == RAYS:
            warn(f"{file}: OpenGL is not available, so each picture of the video takes seconds; see docs/video.md")

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
        options = self._options
        samples = 4 if options.fine else 2
        request = PictureRequest(camera, options.width, options.height, samples=samples, lamp=self._lamp)
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

    def _look_back(self) -> None:
        """Collect the results of earlier frames."""
        while self._waiting and self._waiting[0].done() and not self.error:
            try:
                self._waiting.popleft().result()
                if self.pace is not None:
                    self.pace.count_drawn()
            except RenderingError as error:
                self.error = str(error)
