"""The logical camera: it names the models in its view and tells where they are; nothing hides anything from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.devices.sensors.frustum import Frustum
from cellwright.cell.devices.sensors.scene import Scene, SceneModel
from cellwright.cell.model import parts
from cellwright.cell.model.frames import AGV_T_TRAY
from cellwright.engine.sensor import Reading, Sensor
from cellwright.util.pose import Pose, quaternion_from_rpy, quaternion_product

AGV_TYPES = frozenset({"agv1", "agv2"})
TRAY_TYPE = "kit_tray"
PART_TYPES = frozenset(parts.KNOWN_TYPES)
KNOWN_TYPES = AGV_TYPES | {TRAY_TYPE} | PART_TYPES

POSITION_SD = 0.001
"""Standard deviation of each coordinate of a position [m]."""

ANGLE_SD = 0.01
"""Standard deviation of each of roll, pitch and yaw [rad]."""

_NOISE_A_MODEL = 6


@dataclass(frozen=True, slots=True)
class Frame:
    """A coordinate frame for the tree of frames: `pose` takes coordinates in `child` to coordinates in `parent`."""

    parent: str
    child: str
    pose: Pose


@dataclass(frozen=True, slots=True)
class Detection:
    """A model in view.

    Attributes:
        name: its full name in the cell, which a message does not tell.
        type: its type.
        camera_T_model: where the camera takes it to be.
        frames: the frames that the camera makes known for it; none for a tray, two for an AGV (its own and that of
            the tray on it).
    """

    name: str
    type: str
    camera_T_model: Pose
    frames: tuple[Frame, ...]


@dataclass(frozen=True, kw_only=True)
class CameraReading(Reading):
    """One picture; what is in view is found out when it is needed, as of the moment of the picture.

    Attributes:
        world_T_camera: pose of the camera.
        camera_frame: the frame of the camera itself.
        detect: finds the detections.
    """

    world_T_camera: Pose
    camera_frame: Frame
    detect: Callable[[], tuple[Detection, ...]] = field(repr=False, compare=False)

    @cached_property
    def detections(self) -> tuple[Detection, ...]:
        """What is in view, in the order of the scene."""
        return self.detect()

    @property
    def frames(self) -> tuple[Frame, ...]:
        """All frames of this picture, the camera's first."""
        return (self.camera_frame, *(frame for detection in self.detections for frame in detection.frames))


class LogicalCamera(Sensor[CameraReading]):
    """A logical camera; it looks along the +x axis of its pose.

    A model is in view when the box around it meets the frustum; a tray is when its AGV is. AGVs are told exactly;
    parts and trays with noise in all six coordinates.

    Args:
        name: as in `Sensor`.
        world_T_sensor: as in `Sensor`.
        scene: what there is to see.
        period, latency, noise, enabled: as in `Sensor`.
    """

    default_period: ClassVar[Fraction] = Fraction(1, 10)
    needs_positions: ClassVar[bool] = False
    near: ClassVar[float] = 0.2
    """[m]"""
    far: ClassVar[float] = 0.75
    """[m]"""
    horizontal_fov: ClassVar[float] = 1.1
    """[rad]"""
    aspect: ClassVar[float] = 1.5
    """Width of the view over its height."""

    def __init__(
        self,
        name: str,
        world_T_sensor: Pose,
        scene: Scene,
        *,
        period: Fraction | None = None,
        latency: Fraction = Fraction(0),
        noise: float = 1.0,
        enabled: bool = True,
    ) -> None:
        super().__init__(name, world_T_sensor, period=period, latency=latency, noise=noise, enabled=enabled)
        self.scene = scene
        self.frustum = Frustum(
            world_T_sensor, near=self.near, far=self.far, horizontal_fov=self.horizontal_fov, aspect=self.aspect
        )
        self._tells = np.array([self.tells(model) for model in scene.models], dtype=np.bool_)
        self._camera_T_world = world_T_sensor.inverse()
        self._frame = Frame("world", self.frame, world_T_sensor)

    def tells(self, model: SceneModel) -> bool:
        """Whether the camera reports this model when it is in view."""
        return model.type in KNOWN_TYPES or model.type in self.scene.own_types

    def measure(self, index: int) -> CameraReading:
        """The models in view now."""
        return CameraReading(
            time_ns=self.simulation.now,
            sample=index,
            world_T_camera=self.world_T_sensor,
            camera_frame=self._frame,
            detect=partial(self._look, self.scene.moment(), index),
        )

    def _look(self, moment: bytes, index: int) -> tuple[Detection, ...]:
        in_view = self.frustum.meets(*self.scene.boxes(moment))
        told = np.flatnonzero(in_view[self.scene.nested_in] & self._tells)
        if not told.size:
            return ()
        # every model has its own noise in a sample, whatever else is in view; none is drawn beyond the last
        noise = self.normal(index, _NOISE_A_MODEL * (int(told[-1]) + 1)).reshape(-1, _NOISE_A_MODEL)
        return tuple(map(self._detect, told.tolist(), self.scene.poses(told, moment), noise[told]))

    def _detect(self, index: int, world_T_model: Pose, noise: NDArray[np.float64]) -> Detection:
        model = self.scene.models[index]
        camera_T_model = self._camera_T_world @ world_T_model
        child = f"{self.name}_{model.short_name}_frame"
        if model.type in AGV_TYPES:
            tray = f"{self.name}_kit_tray_{model.type.removeprefix('agv')}_frame"
            # the AGV is told exactly; the noise goes into the place of its tray, which is known, not measured
            frames = (Frame(self.frame, child, camera_T_model), Frame(child, tray, blurred(AGV_T_TRAY, noise)))
            return Detection(model.name, model.type, camera_T_model, frames)
        camera_T_model = blurred(camera_T_model, noise)
        if model.type == TRAY_TYPE:
            return Detection(model.name, model.type, camera_T_model, ())
        return Detection(model.name, model.type, camera_T_model, (Frame(self.frame, child, camera_T_model),))


def blurred(pose: Pose, noise: NDArray[np.float64]) -> Pose:
    """A pose with noise: x, y, z in its parent frame, then roll, pitch, yaw in its own.

    Args:
        pose: the true pose.
        noise: six standard normal numbers.
    """
    dx, dy, dz, roll, pitch, yaw = noise.tolist()
    x, y, z = pose.position
    turn = quaternion_from_rpy(ANGLE_SD * roll, ANGLE_SD * pitch, ANGLE_SD * yaw)
    return Pose(
        (x + POSITION_SD * dx, y + POSITION_SD * dy, z + POSITION_SD * dz), quaternion_product(pose.quaternion, turn)
    )
