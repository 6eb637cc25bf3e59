"""Video of a run or of a served node: frames at exact simulation times, without effect on the run."""

import math
from collections.abc import Callable

import numpy as np

from cellwright.engine.clock import NANOSECONDS, PeriodicCallback
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import LAMP
from cellwright.rendering.scene.engine import DrawnNode, SceneCapture
from cellwright.rendering.video import Video, VideoFigures
from cellwright.rendering.video_options import RATE, VideoOptions, period_of
from cellwright.rendering.video_pace import VideoPace
from cellwright.util.errors import CellwrightError, UsageError
from cellwright.util.pose import Vector3


class VideoRecorder:
    """Video recorder of a simulation.

    Args:
        served: the cell or node that it films.
        options: file, size, speed and quality of the video.
        camera: the camera that it films with.
        caption: returns the line in the corner of each frame.
        waits: hold time until a frame is drawn; else frames are dropped where drawing is slower than time.
        warn: receives a line for each problem, each once.
        lamp: position of the light [m], from the point that the camera looks at.

    Raises:
        UsageError: no video can have this size or speed.
        RenderingError: the file cannot be written.
    """

    def __init__(
        self,
        served: DrawnNode,
        options: VideoOptions,
        *,
        camera: Camera,
        caption: Callable[[], str],
        waits: bool,
        warn: Callable[[str], None],
        lamp: Vector3 = LAMP,
    ) -> None:
        self._served, self._camera, self._caption, self._waits, self._warn = served, camera, caption, waits, warn
        self._capture = SceneCapture.of(served)
        self._period = period_of(options.speed)
        if self._period < (tick := served.simulation.clock.timestep):
            min_speed = float(tick * RATE)
            raise UsageError(
                f"{options.file}: video speed must be at least {min_speed:g}, one frame per tick "
                f"(got {options.speed:g})"
            )
        served.simulation.refresh()
        frame = self._capture.frame(served.simulation.data, served.simulation.now)
        self._video = Video(options, self._capture.scene, frame, camera, lamp=lamp, warn=warn)
        self._taken_at = -1  # time of the newest frame [ns]
        self._watch: PeriodicCallback | None = None
        self.is_whole = True
        """True while the video holds every frame so far."""

    def expect(self, end: int | None, report: Callable[[str], None]) -> None:
        """Report a size that was chosen, and how long drawing takes, and its progress, if that is minutes.

        Args:
            end: latest simulation time [ns] of the video's end; None if no end is known.
            report: receives lines for people.
        """
        options, frames = self._video.options, None
        if end is not None:
            frames = math.ceil(max(0, end - self._served.simulation.now) / (self._period * NANOSECONDS)) + 1
        if self._video.choice:
            report(self._video.choice)
        self._video.pace = VideoPace(options, frames, report, is_bound=True)

    def start(self) -> None:
        """Take the first frame now, and the others as time passes."""
        if self._watch is None:
            self._take(0)
            self._watch = self._served.simulation.watch("video", self._period, self._take)

    def finish(self) -> VideoFigures:
        """Take a last frame of the present moment and finish the file; return the figures of the video."""
        if self._watch is not None:
            self._watch.cancel()
            if self._served.simulation.now > self._taken_at and self.is_whole:
                self._take(0)
        video = self._video
        try:
            video.close()
        except CellwrightError as error:
            self._fail(str(error))
        if video.dropped:
            self._warn(
                f"{video.file}: {video.dropped} of {video.taken + video.dropped} frames dropped; drawing was slower "
                "than the simulation"
            )
        return video.made

    def _take(self, _sample: int) -> None:
        simulation = self._served.simulation
        simulation.refresh()
        frame = self._capture.frame(simulation.data, simulation.now)
        if not np.isfinite(frame.poses).all():  # the simulation has become unstable and is about to end
            return
        self._taken_at = simulation.now
        self._video.take(frame, self._camera, self._caption(), waits=self._waits)
        if self._video.error:
            self._fail(self._video.error)
            if self._watch is not None:
                self._watch.cancel()

    def _fail(self, reason: str) -> None:
        if self.is_whole:
            self.is_whole = False
            self._warn(f"{self._video.file}: video is incomplete: {reason}")
