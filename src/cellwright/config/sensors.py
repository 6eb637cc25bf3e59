"""Sensors and cameras as values."""

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from cellwright.util.pose import Pose

MIN_PICTURE_SIZE, MAX_PICTURE_SIZE = 8, (1920, 1080)
"""Minimum width and height, and the maximum of each [pixels]."""
MAX_DEPTH_PIXELS = 1_000_000
"""Maximum number of pixels of a depth picture, whose point cloud must fit one message."""
MIN_PICTURE_RATE, MAX_PICTURE_RATE = 0.1, 100.0
"""Bounds of the rate of pictures [Hz]."""
MIN_FOV, MAX_FOV = 0.01, 2.8
"""Bounds of the horizontal field of view of a camera [rad]."""
MIN_CAMERA_DEPTH, MAX_CAMERA_DEPTH = 0.02, 100.0
"""Bounds of the depths that a camera measures [m]."""
MAX_CAMERA_LATENCY = 10.0
"""Maximum delay of a picture [s]."""

SensorType: TypeAlias = Literal["break_beam", "proximity_sensor", "logical_camera", "laser_profiler"]
"""Sensor types of the 2017 competition; plugins may add more."""
CameraType: TypeAlias = Literal["rgb_camera", "depth_camera", "rgbd_camera"]
"""Types of picture cameras, which the competitions of later years had."""
WhenLate: TypeAlias = Literal["wait", "drop", "auto"]
"""Policy for a picture that is due but not drawn yet.

`wait` stops simulation time for it. `drop` delivers it later, and drops others for it. `auto` waits, except where
simulation time follows the wall clock.
"""


@dataclass(frozen=True, slots=True)
class SensorConfig:
    """Sensor of the cell; `pose` is in the world frame, `type` a `SensorType` or a plugin's."""

    name: str
    type: str
    pose: Pose


@dataclass(frozen=True, slots=True)
class PictureNoise:
    """Noise of a camera's pictures, as standard deviations.

    Attributes:
        colour: noise of each colour of each pixel, as a share of full brightness.
        depth: noise of each depth [m].
        depth_growth: additional noise per square of the depth [1/m].
    """

    colour: float = 0.007
    depth: float = 0.001
    depth_growth: float = 0.001


@dataclass(frozen=True, slots=True)
class PictureCameraConfig(SensorConfig):
    """Picture camera; `type` is a `CameraType`. It looks along the +x axis of its pose, z is up.

    Attributes:
        frame: frame that it is mounted on and `pose` is given in: `world`, or a link of the arm.
        width, height: size of its pictures [pixels].
        fov: horizontal field of view [rad].
        rate: rate of pictures in simulation time [Hz].
        near, far: minimum and maximum depth that it measures [m].
        shadows: True to draw shadows in its colour pictures, which is slower.
        noise: noise of its pictures.
        latency: delay from the moment that a picture shows to its delivery [s]; None for the time between two pictures.
        when_late: policy for a picture that is due but not drawn yet.
    """

    frame: str = "world"
    width: int = 640
    height: int = 480
    fov: float = 1.047
    rate: float = 10.0
    near: float = 0.1
    far: float = 10.0
    shadows: bool = False
    noise: PictureNoise = field(default_factory=PictureNoise)
    latency: float | None = None
    when_late: WhenLate = "auto"

    @property
    def has_colour(self) -> bool:
        """True if it takes colour pictures."""
        return self.type != "depth_camera"

    @property
    def has_depth(self) -> bool:
        """True if it measures depth."""
        return self.type != "rgb_camera"
