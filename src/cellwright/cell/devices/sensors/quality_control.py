"""The quality control sensors: two logical cameras over the trays that tell faulty parts only."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import ClassVar

from cellwright.cell.devices.sensors.logical_camera import PART_TYPES, LogicalCamera
from cellwright.cell.devices.sensors.scene import Scene, SceneModel
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose

WORLD_T_QUALITY_CONTROL: Mapping[int, Pose] = MappingProxyType(
    {
        1: Pose.from_rpy((0.3, 3.5, 1.5), (0.0, 1.574, -1.574)),
        2: Pose.from_rpy((0.3, -3.5, 1.5), (0.0, 1.574, 1.574)),
    }
)
"""Where the sensors over the trays of AGV 1 and AGV 2 are fixed."""


class QualityControlSensor(LogicalCamera):
    """The sensor `quality_control_sensor_N` over the tray of AGV N.

    Args:
        number: 1 or 2.
        scene: what there is to see.
        faulty_parts: names of the faulty parts, without what comes before the last `|` of a model's name.
        period, latency, noise, enabled: as in `Sensor`.
    """

    near: ClassVar[float] = 0.73
    far: ClassVar[float] = 0.78
    horizontal_fov: ClassVar[float] = 0.7
    aspect: ClassVar[float] = 0.35

    def __init__(
        self,
        number: int,
        scene: Scene,
        faulty_parts: Collection[str],
        *,
        period: Fraction | None = None,
        latency: Fraction = Fraction(0),
        noise: float = 1.0,
        enabled: bool = True,
    ) -> None:
        if number not in WORLD_T_QUALITY_CONTROL:
            raise UnknownNameError("quality control sensor", str(number), map(str, WORLD_T_QUALITY_CONTROL))
        self.faulty_parts = frozenset(faulty_parts)
        super().__init__(
            f"quality_control_sensor_{number}",
            WORLD_T_QUALITY_CONTROL[number],
            scene,
            period=period,
            latency=latency,
            noise=noise,
            enabled=enabled,
        )

    def tells(self, model: SceneModel) -> bool:
        """Whether the sensor reports this model when it is in view: a faulty part."""
        is_part = model.type in PART_TYPES or model.type in self.scene.own_types
        return is_part and model.short_name in self.faulty_parts
