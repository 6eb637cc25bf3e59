"""Devices that other packages bring along: how one is made.

An entry point of the group `cellwright.devices` names a function `make(name, settings, cell)` that returns a `Device`;
a class whose constructor takes these does as well. The device lives as long as its cell, and acts in each tick after
the cell's own.
"""

from __future__ import annotations

from cellwright.config.trial.trial import PluginDevice
from cellwright.engine.device import Device
from cellwright.util.errors import in_a_line
from cellwright.util.plugins import entry_points as plugins
from cellwright.util.plugins.guarded import guard

_HOOKS = ("attach", "reset", "before_step", "drive", "after_step", "handle", "get_state", "set_state", "close")


def make_brought_device(description: PluginDevice, cell: object) -> Device:
    """The device as it was described, for a `Cell` whose own devices and bus are there.

    Raises:
        UnknownNameError: no package brings this type along.
        PluginError: it cannot be imported or made, or is no device.
    """
    kind = description.type
    make = plugins.load("devices", kind)
    if not callable(make):
        raise plugins.refusal(
            "devices", kind, f"must be a function that makes a Device, and is of the type {type(make).__name__}"
        )
    try:
        device = make(description.name, description.settings, cell)
    except Exception as error:
        raise plugins.refusal("devices", kind, f"cannot be made: {in_a_line(error)}") from error
    if not isinstance(device, Device):
        raise plugins.refusal(
            "devices", kind, f"must make a Device, and made something of the type {type(device).__name__}"
        )
    at_work = [hook for hook in _HOOKS if getattr(type(device), hook) is not getattr(Device, hook)]
    return guard(device, "devices", kind, at_work)
