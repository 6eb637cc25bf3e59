"""A video of a scene, drawn and written by a process of its own."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeAlias

from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import LAMP, PictureRequest
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.video_options import RATE, VideoOptions, check_video_size
from cellwright.rendering.worker import RenderingError, RenderWorker
from cellwright.util.pose import Vector3

_WAITING = 6  # frames that may wait to be drawn
_LONGEST_CAPTION = 300  # characters


Made: TypeAlias = dict[str, float | str]
"""What is told of a video: `file`, `length` [s], `frames`, and `dropped`, those of them that were not drawn."""


class Video:
    """A video under way.

    Frames are drawn in a process of its own while whoever gives them goes on; the file can be played however either
    process ends. The same frames give the same pictures on the same machine.

    Args:
        options: file, size and quality.
        scene: what is seen.
        lamp: where the light comes from [m], from the point that the camera looks at, along the axes of the world.
        warn: takes a line where there is no OpenGL.

    Raises:
        UsageError: the size is none that a video can have.
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
        """Frames that were taken."""
        self.dropped = 0
        """Frames that were not drawn, for others waited still; the one before is shown longer instead."""
        self.error = ""
        """Why it has come to an end by itself; empty while all is well."""
        self._options, self._lamp = options, lamp
        self._worker = RenderWorker(scene, most=_WAITING)
        self._repeats = 0
        self._waiting: deque[Future[None]] = deque()
        try:
            self._worker.ask("film", file.absolute(), options.width, options.height, RATE).result()
            draws_with = self._worker.ready.result()
        except RenderingError:
            self._worker.close()
            raise
        if draws_with == RAYS:
            warn(f"{file}: there is no OpenGL here, so each picture of the video takes seconds; see docs/video.md")

    @property
    def made(self) -> Made:
        """What there is to be told of it so far."""
        frames = self.taken + self.dropped
        return {"file": str(self.file), "length": float(frames / RATE), "frames": frames, "dropped": self.dropped}

    def take(self, frame: Frame, camera: Camera, caption: str = "", *, waits: bool = True) -> bool:
        """Add a frame to the video; whether it was. One that has come to an end takes no more.

        Args:
            frame: where the bodies are.
            camera: where they are seen from.
            caption: a line of text in a corner.
            waits: for room, where many frames wait to be drawn; else the frame is dropped, and counted.
        """
        self._look_back()
        if self.error:
            return False
        if waits:
            self._worker.wait_for_room()
        elif self.taken and not self._worker.has_room:
            self.dropped += 1
            self._repeats += 1
            return False
        options = self._options
        samples = 4 if options.fine else 2
        asked = PictureRequest(camera, options.width, options.height, samples=samples, lamp=self._lamp)
        self._waiting.append(self._worker.ask("take", frame, asked, caption[:_LONGEST_CAPTION], self._repeats))
        self.taken += 1
        self._repeats = 0
        return True

    def close(self) -> None:
        """Draw what is left, and finish the file.

        Raises:
            RenderingError: something could not be drawn, or the file could not be written.
        """
        try:
            self._worker.ask("finish", self._repeats).result()
            self._look_back()
        finally:
            self._worker.close()
        if self.error:
            raise RenderingError(self.error)

    def _look_back(self) -> None:
        """See what has come of the frames that were given."""
        while self._waiting and self._waiting[0].done() and not self.error:
            try:
                self._waiting.popleft().result()
            except RenderingError as error:
                self.error = str(error)
