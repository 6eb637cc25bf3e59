"""Camera sensors: colour and depth pictures, with reproducible noise.

A normal random number per pixel would take longer than the rest of the cell's work for a picture. So random bytes
choose from a table of the normal distribution's quantiles. It is exact to the eye and in its standard deviation.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cellwright.config.sensors import PictureCameraConfig, PictureNoise
from cellwright.engine.device import State
from cellwright.engine.random_streams import SampleNoise
from cellwright.engine.sensor import Reading, Sensor
from cellwright.engine.simulation import Simulation
from cellwright.rendering.backend import requested_backend
from cellwright.rendering.camera import Pinhole
from cellwright.rendering.cameras.render_service import Drawn, PendingPicture, RenderService
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

_COLOUR_STREAM, _DEPTH_STREAM = 1, 2  # streams of random bytes
_WHITE = 255
_LEVELS = 256
_FARTHEST_SHOWN = 1.0  # [m] of a view that viewers draw; the rest would fill the cell with lines
_COLOUR, _DEPTH = "colour", "depth"
_A_SECOND = 1_000_000_000  # [ns]


def blur_colour(
    colour: NDArray[np.uint8], noise: PictureNoise, chance: SampleNoise, sample: int, factor: float = 1.0
) -> NDArray[np.uint8]:
    """Return a picture of any shape with the noise of its number `sample`; `factor` scales the standard deviation."""
    deviation = noise.colour * factor * _WHITE
    if deviation == 0.0:
        return colour
    random = chance.bytes(sample, colour.size, _COLOUR_STREAM).tobytes()
    shifts = np.clip(np.rint(_quantiles() * deviation), -_WHITE, _WHITE)
    up, down = (
        np.frombuffer(random.translate(table.astype(np.uint8).tobytes()), np.uint8).reshape(colour.shape)
        for table in (np.maximum(shifts, 0), np.maximum(-shifts, 0))
    )
    # Sums of single bytes, which never overflow.
    blurred = np.minimum(colour, _WHITE - up)
    blurred += up
    np.maximum(blurred, down, out=blurred)
    blurred -= down
    return blurred


def blur_depth(
    depth: NDArray[np.float32], noise: PictureNoise, chance: SampleNoise, sample: int, factor: float = 1.0
) -> NDArray[np.float32]:
    """Return depths [m] with noise, as in `blur_colour`; values that are not finite stay."""
    if factor == 0.0 or noise.depth == noise.depth_growth == 0.0:
        return depth
    random = chance.bytes(sample, depth.size, _DEPTH_STREAM).reshape(depth.shape)
    deviation = np.float32(factor * noise.depth) + np.float32(factor * noise.depth_growth) * depth * depth
    blurred: NDArray[np.float32] = depth + deviation * _quantiles()[random]
    return blurred


@cache
def _quantiles() -> NDArray[np.float32]:
    """Equally likely numbers with a normal distribution and a standard deviation of 1."""
    from statistics import NormalDist

    normal = NormalDist()
    found = np.array([normal.inv_cdf((level + 0.5) / _LEVELS) for level in range(_LEVELS)])
    scaled: NDArray[np.float64] = found / found.std()
    return scaled.astype(np.float32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture(Reading):
    """Picture with the requested channels. Its arrays are read-only.

    Attributes:
        world_T_camera: pose of the camera.
        colour: (height, width, 3) sRGB.
        depth: (height, width) along the line of sight [m]; NaN where nothing was measured.
    """

    world_T_camera: Pose
    colour: NDArray[np.uint8] | None
    depth: NDArray[np.float32] | None


@dataclass(frozen=True, slots=True)
class _Exposure:
    """Picture that is being drawn, with the time of its tick; no pending picture: it needs no drawing."""

    time_ns: int
    sample: int
    world_T_camera: Pose
    pending: PendingPicture | None


class PictureCamera(Sensor[Picture]):
    """Camera sensor. It draws only colour and depth that its listeners request.

    Drawing starts in the tick that the picture shows; the picture comes `latency` later, in simulation time. How long
    drawing took changes nothing about it. If it is not ready by then, simulation time waits. A camera that drops
    pictures does not wait: a late picture comes when it is ready, and the ones due meanwhile are dropped, counted and
    reported.

    Args:
        description: its entry in the trial.
        service: draws the pictures.
        report: receives a line about dropped pictures, at most one per second of simulation time.

    Raises:
        UsageError: the environment sets a backend that does not exist.
    """

    default_period: ClassVar[Fraction] = Fraction(1, 10)

    def __init__(
        self,
        description: PictureCameraConfig,
        service: RenderService,
        *,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        # An unknown backend is refused now, not with the first picture.
        requested_backend()
        period = 1 / Fraction(repr(description.rate))
        latency = period if description.latency is None else Fraction(repr(description.latency))
        super().__init__(description.name, description.pose, period=period, latency=latency)
        self.description = description
        self.pinhole = Pinhole(description.width, description.height, description.fov)
        self.optical_frame = f"{description.name}_optical_frame"
        """Name of the frame with x to the right, y down and z along the line of sight."""
        self.dropped = 0
        """Pictures dropped since the run began."""
        self._service = service
        self._report = report
        self._body: int | None = None
        self._requests: Counter[str] = Counter()
        self._exposures: deque[_Exposure] = deque()
        self._unreported = 0
        self._reported_at = -_A_SECOND

    def listen(self, callback: Callable[[Picture], None]) -> Callable[[], None]:
        """Call `callback` with every picture, in all channels of the camera. See `Sensor.listen`."""
        return self.look(callback, colour=self.description.has_colour, depth=self.description.has_depth)

    def look(self, callback: Callable[[Picture], None], *, colour: bool, depth: bool) -> Callable[[], None]:
        """Call `callback` with every picture, with colour, depth or neither, and channels that others request.

        Returns:
            A function that ends it. Further calls do nothing.

        Raises:
            UsageError: the camera takes no such pictures.
        """
        lacks_colour = colour and not self.description.has_colour
        if lacks_colour or (depth and not self.description.has_depth):
            channel = "colour" if lacks_colour else "depth"
            raise UsageError(f"camera {self.name!r}: a {self.description.type} has no {channel}")
        channels = [each for each, is_requested in ((_COLOUR, colour), (_DEPTH, depth)) if is_requested]
        self._requests.update(channels)
        leave = super().listen(callback)
        is_there = True

        def leave_once() -> None:
            nonlocal is_there
            if is_there:
                is_there = False
                self._requests.subtract(channels)
            leave()

        return leave_once

    @property
    def world_T_camera(self) -> Pose:
        """Pose of the camera. Positions in the engine's data must be up to date."""
        if self._body is None:
            return self.world_T_sensor
        data = self.simulation.data
        x, y, z = data.xpos[self._body].tolist()
        qw, qx, qy, qz = data.xquat[self._body].tolist()
        return Pose((x, y, z), (qw, qx, qy, qz)) @ self.world_T_sensor

    def describe(self) -> dict[str, Any]:
        """Geometry for viewers: a frustum."""
        far = min(self.description.far, _FARTHEST_SHOWN)
        figures = {"near": min(self.description.near, far), "far": far, "angle": self.pinhole.fov / 2}
        aspect = self.pinhole.width / self.pinhole.height
        return super().describe() | self._place() | {"form": "frustum", "aspect": aspect} | figures

    def overlay(self) -> dict[str, Any]:
        """Pose for viewers, `position` and `quaternion`; it draws no picture."""
        return {"sees": False, "ranges": []} | self._place()

    def _place(self) -> dict[str, Any]:
        pose = self.world_T_camera
        return {
            "position": [round(each, 4) for each in pose.position],
            "quaternion": [round(each, 5) for each in pose.quaternion],
        }

    def measure(self, index: int) -> Picture:
        """Return a picture of now, in all channels of the camera; wait until it is drawn.

        Raises:
            UsageError: nothing can be drawn.
        """
        return self._finish(self._expose(index))

    def _expose(self, index: int) -> _Exposure:
        """Request a picture of now, in all channels."""
        pose = self.world_T_camera
        pending = self._begin(pose, colour=self.description.has_colour, depth=self.description.has_depth)
        return _Exposure(self.simulation.now, index, pose, pending)

    def _finish(self, exposure: _Exposure) -> Picture:
        """Wait for a picture that was requested by `_expose`."""
        drawn = None if exposure.pending is None else self._service.fetch(exposure.pending)
        if drawn is None:
            raise UsageError(f"camera {self.name!r}: no picture, since rendering has failed in this run")
        return self._developed(exposure, drawn)

    def _sample(self, index: int) -> None:
        if not self.enabled:
            return
        self.simulation.refresh()
        pose, colour, depth = self.world_T_camera, self._requests[_COLOUR] > 0, self._requests[_DEPTH] > 0
        pending = None
        if colour or depth:
            if self._drops and self._is_behind:
                self._leave_out()
                return
            pending = self._begin(pose, colour=colour, depth=depth)
            if pending is None:
                return
        self._exposures.append(_Exposure(self.simulation.now, index, pose, pending))
        if not self._latency_ns:
            self._deliver_due(0)

    def _begin(self, world_T_camera: Pose, *, colour: bool, depth: bool) -> PendingPicture | None:
        shadows = self.description.shadows
        return self._service.ask(self.pinhole, world_T_camera, colour=colour, depth=depth, shadows=shadows)

    def _deliver_due(self, _tick: int) -> None:
        latest = self.simulation.now - self._latency_ns
        while self._exposures and self._exposures[0].time_ns <= latest:
            pending = self._exposures[0].pending
            if pending is not None and self._drops and not pending.is_drawn:
                break  # it comes when it is ready
            exposure = self._exposures.popleft()
            drawn = (None, None) if pending is None else self._service.fetch(pending)
            if drawn is not None:
                self._deliver(self._developed(exposure, drawn))

    def _developed(self, exposure: _Exposure, drawn: Drawn) -> Picture:
        """Add the camera's noise, and apply its range."""
        (colour, depth), chance = drawn, self._noise_stream
        settings = self.description
        if colour is not None:
            if chance is not None:
                colour = blur_colour(colour, settings.noise, chance, exposure.sample, self.noise)
            colour.flags.writeable = False
        if depth is not None:
            is_measured = (depth >= settings.near) & (depth <= settings.far)
            depth = np.where(is_measured, depth, np.float32(np.nan))
            if chance is not None:
                depth = blur_depth(depth, settings.noise, chance, exposure.sample, self.noise)
            depth.flags.writeable = False
        return Picture(
            time_ns=exposure.time_ns,
            sample=exposure.sample,
            world_T_camera=exposure.world_T_camera,
            colour=colour,
            depth=depth,
        )

    @property
    def _drops(self) -> bool:
        late = self.description.when_late
        if not self._latency_ns:  # it is due in its own tick, and drawing takes time
            return False
        return late == "drop" or (late == "auto" and self.simulation.is_paced)

    @property
    def _is_behind(self) -> bool:
        """True if too many pictures are being drawn for another one to be on time."""
        max_waiting = max(1, -(-self._latency_ns // self._period_ns))
        waiting = sum(each.pending is not None and not each.pending.is_drawn for each in self._exposures)
        return waiting >= max_waiting

    def _leave_out(self) -> None:
        self.dropped += 1
        self._unreported += 1
        now = self.simulation.now
        if now - self._reported_at >= _A_SECOND and self._service.is_ready:
            noun = "picture" if self._unreported == 1 else "pictures"
            self._report(
                f"camera {self.name}: {self._unreported} {noun} dropped ({self.dropped} in all); "
                "drawing takes longer than the camera's period"
            )
            self._reported_at, self._unreported = now, 0

    def attach(self, simulation: Simulation) -> None:
        """Join a simulation, on the body that the camera is fixed to."""
        super().attach(simulation)
        self._period_ns = int(self.period * _A_SECOND)
        if self.description.frame != "world":
            self._body = int(simulation.model.body(self.description.frame).id)

    def reset(self) -> None:
        """Start a run, with no dropped pictures."""
        super().reset()
        self.dropped = self._unreported = 0
        self._reported_at = -_A_SECOND
        self._service.reopen()

    def close(self) -> None:
        """Remove all listeners, and release the render process."""
        super().close()
        self._service.close()

    @property
    def pending(self) -> Iterable[_Exposure]:
        """Exposures whose pictures were not delivered yet."""
        return self._exposures

    @pending.setter
    def pending(self, exposures: Iterable[_Exposure]) -> None:
        self._exposures = deque(exposures)

    def set_state(self, state: State) -> None:
        """Restore the switch; the frame that was drawn last is another one's."""
        super().set_state(state)
        self._service.reopen()

    def _drop_pending(self) -> None:
        super()._drop_pending()
        self._exposures.clear()


def read_pictures(cameras: Iterable[PictureCamera]) -> list[Picture]:
    """Return a picture of now from each of several cameras, of any number of cells and robots, in all their channels.

    One process draws those of all cells. A picture is equal to the one that `PictureCamera.read` returns.

    Raises:
        UsageError: a camera is switched off, or rendering has failed in this run.

    Example:
        >>> read_pictures([])
        []
    """
    return ask_pictures(cameras)()


def ask_pictures(cameras: Iterable[PictureCamera]) -> Callable[[], list[Picture]]:
    """Ask for what `read_pictures` returns, and return the function that waits for it; time may go on meanwhile.

    Raises:
        UsageError: as of `read_pictures`, now or when they are awaited.
    """
    exposures = [(camera, camera._expose(camera._latest_index())) for camera in cameras]
    return lambda: [camera._finish(exposure) for camera, exposure in exposures]
