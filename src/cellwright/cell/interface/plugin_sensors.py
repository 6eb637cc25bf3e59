"""Sensors that other packages bring along: how one is made, and what it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cellwright.cell.devices.sensors.scene import Scene
from cellwright.cell.interface.devices import GearDevices
from cellwright.config.trial.sensors import SENSOR_TYPES
from cellwright.config.trial.trial import Camera
from cellwright.config.trial.trial import Sensor as SensorDescription
from cellwright.engine.sensor import Reading, Sensor
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.sampling import Streamed
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages import Message
from cellwright.util.errors import in_a_line
from cellwright.util.plugins import entry_points as plugins
from cellwright.util.plugins.guarded import call, guard

_AT_WORK = ("measure", "attach", "reset", "get_state", "set_state", "close")


@dataclass(frozen=True, slots=True)
class SensorPlugin:
    """What an entry point of the group `cellwright.sensors` names; the entry point's name is the sensor type in files.

    Attributes:
        make: the device for a sensor as it was described, in a scene of models to see.
        row: the topic that it speaks on, with `{sensor}` where the sensor's name belongs.
        message: the message for a reading, of the row's type.
    """

    make: Callable[[SensorDescription, Scene], Sensor[Any]]
    row: Row
    message: Callable[[Any, Sensor[Any]], Message]


def make_brought_sensor(description: SensorDescription, scene: Scene) -> Sensor[Any]:
    """The device for a sensor of another package's type.

    Raises:
        UnknownNameError: no package brings this type along.
        PluginError: it cannot be imported or made, or is no sensor.
    """
    kind = description.type
    plugin = plugins.load_as("sensors", kind, SensorPlugin)
    try:
        sensor = plugin.make(description, scene)
    except Exception as error:
        raise plugins.refusal("sensors", kind, f"cannot be made: {in_a_line(error)}") from error
    if not isinstance(sensor, Sensor):
        raise plugins.refusal(
            "sensors", kind, f"must make a Sensor, and made something of the type {type(sensor).__name__}"
        )
    return guard(sensor, "sensors", kind, _AT_WORK)


def bind_brought_sensors(bus: Bus, devices: GearDevices) -> None:
    """Put the topics of all sensors of other packages on the bus.

    Raises:
        PluginError: one of them cannot be used.
        UsageError: it would publish where something else does, in another type.
    """
    for description in devices.trial.sensors:
        if description.type not in SENSOR_TYPES and not isinstance(description, Camera):
            plugin = plugins.load_as("sensors", description.type, SensorPlugin)
            _stream(bus, description.type, plugin, devices.sensors[description.name])


def _stream(bus: Bus, kind: str, plugin: SensorPlugin, sensor: Sensor[Any]) -> None:
    def build(reading: Reading) -> Message:
        message: Message = call("sensors", kind, plugin.message, reading, sensor)
        return message

    Streamed(bus, plugin.row.of(sensor.name), sensor.listen, build)
