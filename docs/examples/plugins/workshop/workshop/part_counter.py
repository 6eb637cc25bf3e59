"""A sensor that counts the parts near it."""

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

import numpy as np

from cellwright.cell.devices.scene import ModelSnapshot
from cellwright.cell.interface.plugins import SensorPlugin
from cellwright.config.sensors import SensorConfig
from cellwright.engine.sensor import Reading, Sensor
from cellwright.middleware.interface.table import ALWAYS, publishes
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.standard import Float32

RADIUS = 0.5  # [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Count(Reading):
    """Number of parts in a sample."""

    parts: int


class PartCounter(Sensor[Count]):
    """Counts the models within RADIUS of its pose whose type ends in `_part`."""

    default_period: ClassVar[Fraction] = Fraction(1, 10)

    def __init__(self, description: SensorConfig, scene: ModelSnapshot) -> None:
        super().__init__(description.name, description.pose)
        self.scene = scene

    def measure(self, index: int) -> Count:
        """The parts that are near now."""
        centres, _ = self.scene.boxes()
        near = np.linalg.norm(centres - self.world_T_sensor.position, axis=1) < RADIUS
        parts = sum(bool(near[k]) for k, model in enumerate(self.scene.models) if model.type.endswith("_part"))
        return Count(time_ns=self.simulation.now, sample=index, parts=parts)


def message(reading: Count, _: Sensor[Count]) -> Message:
    """Message of a reading."""
    return Float32(float(reading.parts))


PART_COUNTER = SensorPlugin(
    make=PartCounter,
    row=publishes("/ariac/{sensor}", "std_msgs/Float32", 10, ALWAYS, "How many parts are near."),
    message=message,
)
