"""A video of a scene, drawn and written by a process of its own."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future
from fractions import Fraction
from pathlib import Path

from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import LAMP
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.video_options import HEIGHT, RATE, WIDTH, check_video_size
from cellwright.rendering.worker import RenderingError, RenderWorker
from cellwright.util.pose import Vector3

_WAITING = 6  # frames that may wait to be drawn
_LONGEST_CAPTION = 300  # characters


class Video:
    """A video under way.

    Frames are drawn in a process of its own while whoever gives them goes on; the file can be played however either
    process ends. The same frames give the same pictures on the same machine.

    Args:
        file: of the video, MP4; overwritten.
        scene: what is seen.
        width: in pixels; even.
        height: in pixels; even.
        rate: pictures a second, as it is played.
        fine: smoother edges, which takes half as long again without a GPU.
        lamp: where the light comes from [m], from the point that the camera looks at, along the axes of the world.

    Raises:
        UsageError: the size is none that a video can have.
        RenderingError: the file cannot be written.
    """

    def __init__(
        self,
        file: Path,
        scene: Scene,
        width: int = WIDTH,
        height: int = HEIGHT,
        *,
        rate: Fraction = RATE,
        fine: bool = False,
        lamp: Vector3 = LAMP,
    ) -> None:
        check_video_size(width, height)
        self.file = file
        self.taken = 0
        """Frames that were taken."""
        self.dropped = 0
        """Frames that were not drawn, for others waited still; the one before is shown longer instead."""
        self.error = ""
        """Why it has come to an end by itself; empty while all is well."""
        self._rate = rate
        self._worker = RenderWorker(scene, most=_WAITING)
        self._repeats = 0
        self._waiting: deque[Future[None]] = deque()
        samples = 4 if fine else 2
        opened = self._worker.ask("film", file.absolute(), rate, width, height, samples=samples, lamp=lamp)
        try:
            opened.result()
            self.draws_with = self._worker.ready.result()
            """What it is drawn with, in words; `rays` where there is no OpenGL, and then it takes seconds a picture."""
        except RenderingError:
            self._worker.close()
            raise

    @property
    def length(self) -> float:
        """How long it is so far [s], as it is played."""
        return float((self.taken + self.dropped) / self._rate)

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
        self._waiting.append(self._worker.ask("take", frame, camera, caption[:_LONGEST_CAPTION], self._repeats))
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
