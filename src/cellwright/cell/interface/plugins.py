"""Plugin sensors and devices: their creation, and the topics of the sensors.

An entry point of the group `cellwright.devices` names a function `make(name, settings, cell)` that returns a `Device`,
or a class whose constructor takes these arguments. The device lives as long as its cell, and acts in each tick after
the cell's own devices.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from cellwright.cell.devices.scene import ModelSnapshot
from cellwright.cell.interface.devices import CellDevices
from cellwright.cell.interface.rows import NODE
from cellwright.config.sensors import PictureCameraConfig, SensorConfig
from cellwright.config.trial.trial import PluginDevice
from cellwright.config.trial.values import SENSOR_TYPES
from cellwright.engine.device import Device
from cellwright.engine.sensor import Reading, Sensor
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages import Message
from cellwright.util import plugins
from cellwright.util.errors import one_line
from cellwright.util.plugins import call_plugin, guard_plugin

_HOOKS = ("attach", "reset", "before_step", "drive", "after_step", "handle", "get_state", "set_state", "close")


def make_plugin_device(description: PluginDevice, cell: object) -> Device:
    """Make a plugin device from its description, for a `Cell` whose own devices and bus exist.

    Raises:
        UnknownNameError: no package provides this type.
        PluginError: it cannot be imported or made, or is no device.
    """
    kind = description.type
    make = plugins.load("devices", kind)
    if not callable(make):
        raise plugins.plugin_error(
            "devices", kind, f"must be a function that makes a Device (got {type(make).__name__})"
        )
    device: Device = _make("devices", kind, make, Device, description.name, description.settings, cell)
    return guard_plugin(device, "devices", kind, _HOOKS)


@dataclass(frozen=True, slots=True)
class SensorPlugin:
    """Object of an entry point of the group `cellwright.sensors`; the entry point's name is the sensor type in files.

    Attributes:
        make: makes the device from a sensor's description and the scene of models that it sees.
        row: the topic of its readings, with `{sensor}` in place of the sensor's name.
        message: converts a reading to a message of the row's type; `time_ns` is in message time then.

    Example:
        >>> from cellwright import SensorPlugin
        >>> from cellwright.cell.devices.range_sensors import BreakBeam
        >>> from cellwright.middleware.interface.table import ALWAYS, publishes
        >>> from cellwright.middleware.messages.standard import Float32
        >>> plugin = SensorPlugin(
        ...     make=lambda description, scene: BreakBeam(description.name, description.pose),
        ...     row=publishes("/ariac/{sensor}", "std_msgs/Float32", 20, ALWAYS, "Range of the beam [m]."),
        ...     message=lambda reading, sensor: Float32(reading.range),
        ... )
        >>> plugin.row.of("beam_1").name
        '/ariac/beam_1'
    """

    make: Callable[[SensorConfig, ModelSnapshot], Sensor[Any]]
    row: Endpoint
    message: Callable[[Any, Sensor[Any]], Message]


def make_plugin_sensor(description: SensorConfig, scene: ModelSnapshot) -> Sensor[Any]:
    """Make the device of a plugin sensor.

    Raises:
        UnknownNameError: no package provides this type.
        PluginError: it cannot be imported or made, or is no sensor.
    """
    kind = description.type
    plugin = plugins.load_as("sensors", kind, SensorPlugin)
    sensor: Sensor[Any] = _make("sensors", kind, plugin.make, Sensor, description, scene)
    return guard_plugin(sensor, "sensors", kind, ("measure", *_HOOKS))


def _make(group: plugins.Kind, kind: str, make: Callable[..., Any], base: type[Any], *arguments: object) -> Any:
    """Call a plugin's `make`, and check that it returns an instance of `base`."""
    try:
        made = make(*arguments)
    except Exception as error:
        raise plugins.plugin_error(group, kind, f"cannot be made: {one_line(error)}") from error
    if not isinstance(made, base):
        problem = f"must make a {base.__name__} (got {type(made).__name__})"
        raise plugins.plugin_error(group, kind, problem)
    return made


def bind_plugin_sensors(bus: Bus, devices: CellDevices) -> None:
    """Put the topics of all plugin sensors on the bus.

    Raises:
        PluginError: a plugin sensor cannot be used.
        UsageError: a topic is already published with another type.
    """
    for description in devices.trial.sensors:
        if description.type not in SENSOR_TYPES and not isinstance(description, PictureCameraConfig):
            plugin = plugins.load_as("sensors", description.type, SensorPlugin)
            _stream_plugin(bus, description.type, plugin, devices.sensors[description.name])


def _stream_plugin(bus: Bus, kind: str, plugin: SensorPlugin, sensor: Sensor[Any]) -> None:
    def build(reading: Reading) -> Message:
        message: Message = call_plugin("sensors", kind, plugin.message, reading, sensor)
        return message

    row = replace(plugin.row.of(sensor.name), node=plugin.row.node or NODE)
    Output(bus, sensor.simulation, row).stream(sensor.listen, build)
