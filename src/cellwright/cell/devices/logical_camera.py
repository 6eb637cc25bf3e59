"""Logical cameras: detections of models in view, with noise; and quality control sensors."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, ClassVar, NamedTuple, Self, Unpack

import numpy as np

from cellwright.cell.devices.scene import Frustum, ModelSnapshot, SceneModel, SeenModels, StoredState
from cellwright.cell.kitting.inventory import trimmed_name
from cellwright.cell.model import parts
from cellwright.config.layout.layout import Carrier
from cellwright.engine.sensor import Reading, Sensor, SensorOptions
from cellwright.util.pose import Pose, quaternion_from_rpy, quaternion_product

TRAY_TYPE = "kit_tray"
PART_TYPES = frozenset(parts.KNOWN_TYPES)
KNOWN_TYPES = {TRAY_TYPE} | PART_TYPES
POSITION_SD = 0.001
"""Standard deviation of each coordinate of a position [m]."""
ANGLE_SD = 0.01
"""Standard deviation of each of roll, pitch and yaw [rad]."""
_NOISE_A_MODEL = 6


class TfFrame(NamedTuple):
    """Coordinate frame for the tree of frames: `pose` maps coordinates in `child` to coordinates in `parent`."""

    parent: str
    child: str
    pose: Pose


class Detection(NamedTuple):
    """Detected model.

    Attributes:
        name: its full name in the cell, which a message does not contain.
        camera_T_model: its measured pose.
        frames: the frames that the camera publishes for it. A tray has none, an AGV has two: its own and that of its
            tray.
    """

    name: str
    type: str
    camera_T_model: Pose
    frames: tuple[TfFrame, ...]


@dataclass(frozen=True, kw_only=True)
class CameraReading(Reading):
    """Logical picture; its detections are computed on demand, as of the time of the picture."""

    world_T_camera: Pose
    camera_frame: TfFrame
    detect: Callable[[], tuple[Detection, ...]] = field(repr=False, compare=False)

    @cached_property
    def detections(self) -> tuple[Detection, ...]:
        """Models in view, in the order of the scene."""
        return self.detect()

    def restamped(self, time_ns: int) -> Self:
        """Return the picture with another time; both compute their detections once."""
        return replace(self, time_ns=time_ns, detect=lambda: self.detections)

    @property
    def frames(self) -> tuple[TfFrame, ...]:
        """All frames of this picture, the camera's first."""
        return (self.camera_frame, *(frame for detection in self.detections for frame in detection.frames))


class LogicalCamera(Sensor[CameraReading]):
    """Logical camera; it looks along the +x axis of its pose. Arguments as in `Sensor`, and the scene.

    A model is in view when the box around it meets the frustum; a tray is when its AGV is. AGVs are measured exactly;
    parts and trays with noise in all six coordinates.
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

    def __init__(self, name: str, world_T_sensor: Pose, scene: ModelSnapshot, **options: Unpack[SensorOptions]) -> None:
        super().__init__(name, world_T_sensor, **options)
        self.scene = scene
        self.frustum = Frustum(
            world_T_sensor, near=self.near, far=self.far, horizontal_fov=self.horizontal_fov, aspect=self.aspect
        )
        reported = np.array([self.reports(model) for model in scene.models], dtype=np.bool_)
        self._view = scene.add_view(self.frustum, reported)
        self._camera_T_world = world_T_sensor.inverse()
        self._children = [f"{name}_{trimmed_name(model.name)}_frame" for model in scene.models]
        self._frame = TfFrame("world", self.frame, world_T_sensor)
        self._exact_of: tuple[list[int], bytes] = [], b""
        self._exact: list[Pose] = []

    def reports(self, model: SceneModel) -> bool:
        """Return whether the camera reports this model when it is in view."""
        return model.tray is not None or model.type in KNOWN_TYPES or model.type in self.scene.own_types

    def measure(self, index: int) -> CameraReading:
        """Measure the models in view now."""
        return CameraReading(
            time_ns=self.simulation.now,
            sample=index,
            world_T_camera=self.world_T_sensor,
            camera_frame=self._frame,
            detect=partial(self._detect_all, self.scene.save(), index),
        )

    def describe(self) -> dict[str, Any]:
        """Return the description for viewers: a frustum."""
        figures = {"near": self.near, "far": self.far, "angle": self.horizontal_fov / 2, "aspect": self.aspect}
        return super().describe() | {"form": "frustum"} | figures

    def overlay(self) -> dict[str, Any]:
        """Return the overlay of a reading now, for viewers."""
        return {"sees": bool(self.read().detections), "ranges": []}

    def _detect_all(self, state: StoredState, index: int) -> tuple[Detection, ...]:
        seen = self.scene.seen(self._view, state)
        if not seen.indices:
            return ()
        # every model has its own noise in a sample, whatever else is in view; none is drawn beyond the last
        noise = self.normal(index, _NOISE_A_MODEL * (seen.indices[-1] + 1)).reshape(-1, _NOISE_A_MODEL)
        return tuple(map(self._detect, seen.indices, self._exact_poses(seen), noise.take(seen.indices, 0).tolist()))

    def _exact_poses(self, seen: SeenModels) -> list[Pose]:
        """Return camera_T_model of the models in view; in most samples they are where they were."""
        exact_of = seen.indices, seen.poses.tobytes()
        if exact_of != self._exact_of:
            poses, camera_T_world = seen.poses.tolist(), self._camera_T_world
            self._exact = [camera_T_world @ Pose((x, y, z), (qw, qx, qy, qz)) for x, y, z, qw, qx, qy, qz in poses]
            self._exact_of = exact_of
        return self._exact

    def _detect(self, index: int, camera_T_model: Pose, noise: Sequence[float]) -> Detection:
        model, child = self.scene.models[index], self._children[index]
        kind = model.type
        if model.tray is not None:
            tray = f"{self.name}_{model.tray.tray_name}_frame"
            # the AGV is measured exactly; the noise goes into the pose of its tray, which is known, not measured
            child_T_tray = blurred(model.tray.home_T_tray, noise)
            frames = (TfFrame(self.frame, child, camera_T_model), TfFrame(child, tray, child_T_tray))
            return Detection(model.name, kind, camera_T_model, frames)
        camera_T_model = blurred(camera_T_model, noise)
        if model.nested_in is not None:  # a frame of its AGV
            return Detection(model.name, kind, camera_T_model, ())
        return Detection(model.name, kind, camera_T_model, (TfFrame(self.frame, child, camera_T_model),))


def blurred(pose: Pose, noise: Sequence[float]) -> Pose:
    """Return a pose with noise: x, y, z in its parent frame, then roll, pitch, yaw in its own.

    Args:
        pose: the exact pose.
        noise: six standard normal numbers.
    """
    dx, dy, dz, roll, pitch, yaw = noise
    x, y, z = pose.position
    turn = quaternion_from_rpy(ANGLE_SD * roll, ANGLE_SD * pitch, ANGLE_SD * yaw)
    return Pose(
        (x + POSITION_SD * dx, y + POSITION_SD * dy, z + POSITION_SD * dz), quaternion_product(pose.quaternion, turn)
    )


class QualityControlSensor(LogicalCamera):
    """Sensor `quality_control_sensor_1` over the tray of AGV 1, and so on. It reports the faulty parts.

    Faulty parts are listed by the section of a model's name after the last `|`.
    """

    near: ClassVar[float] = 0.73
    far: ClassVar[float] = 0.78
    horizontal_fov: ClassVar[float] = 0.7
    aspect: ClassVar[float] = 0.35

    def __init__(
        self, carrier: Carrier, scene: ModelSnapshot, faulty_parts: Collection[str], **options: Unpack[SensorOptions]
    ) -> None:
        self.faulty_parts = frozenset(faulty_parts)
        super().__init__(f"quality_control_sensor_{carrier.number}", carrier.quality, scene, **options)

    def reports(self, model: SceneModel) -> bool:
        """Return whether the sensor reports this model when it is in view: a faulty part."""
        is_part = model.type in PART_TYPES or model.type in self.scene.own_types
        return is_part and trimmed_name(model.name) in self.faulty_parts
