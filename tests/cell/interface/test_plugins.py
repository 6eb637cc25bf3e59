"""Plugins of the cell: what they make is checked, and their faults name them."""

from importlib.metadata import EntryPoint

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.interface.plugins import make_plugin_device, make_plugin_sensor
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import PluginDevice, Trial
from cellwright.engine.device import Device
from cellwright.util import plugins
from cellwright.util.errors import UnknownNameError
from cellwright.util.plugins import PluginError, PluginFailedError
from cellwright.util.pose import Pose


class Blinker(Device):
    def __init__(self, name: str, settings: object, _cell: object) -> None:
        super().__init__(name)
        self.settings = settings

    def before_step(self) -> None:
        raise ValueError("no power")


def seven(*_: object) -> int:
    return 7


def fails(*_: object) -> Device:
    raise ValueError("not today")


def provide(monkeypatch: pytest.MonkeyPatch, attribute: str) -> PluginDevice:
    """Offer an attribute of this module as a device type, and return a description of such a device."""
    entry = EntryPoint("blinker", f"{__name__}:{attribute}", "cellwright.devices")
    monkeypatch.setattr(plugins, "_entry_points", lambda _kind: (entry,))
    return PluginDevice("lamp", "blinker", {"rate": 2})


def test_device_gets_its_name_and_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    device = make_plugin_device(provide(monkeypatch, "Blinker"), None)
    assert isinstance(device, Blinker)
    assert (device.name, device.settings) == ("lamp", {"rate": 2})


@pytest.mark.parametrize(
    ("attribute", "message"),
    [
        ("__name__", "must be a function that makes a Device"),
        ("seven", r"must make a Device \(got int\)"),
        ("fails", "cannot be made: ValueError: not today"),
    ],
)
def test_what_is_no_device_is_refused(monkeypatch: pytest.MonkeyPatch, attribute: str, message: str) -> None:
    description = provide(monkeypatch, attribute)
    with pytest.raises(PluginError, match=message):
        make_plugin_device(description, None)


def test_fault_in_a_tick_names_the_plugin(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(Trial("plugged", devices=(provide(monkeypatch, "Blinker"),)))
    with pytest.raises(PluginFailedError, match=r"'blinker' .*no power"):
        cell.step()


def test_unknown_sensor_type_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="sonar"):
        make_plugin_sensor(SensorConfig("s", "sonar", Pose()), None)  # type: ignore[arg-type]
