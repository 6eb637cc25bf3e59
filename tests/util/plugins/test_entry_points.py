"""Plugins of other packages: found by name, refused by name, and without effect on other users."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.cli.main import main
from cellwright.clients.agents.agent import Agent, AgentError, find_agent
from cellwright.clients.client.client import Client
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.running.run import Outcome, RunOptions, run_cell
from cellwright.util import plugins as plugins
from cellwright.util.errors import DescriptionError, UnknownNameError
from cellwright.util.plugins import PluginError
from tests.support.workshop import describe, install

BROKEN = """
raise ImportError("no such\\nluck")
"""
ODD = """
import pathlib
from cellwright.cell.interface.plugins import SensorPlugin
from cellwright.middleware.interface.table import ALWAYS, publishes

def fails(*arguments):
    raise ValueError("not today")

def number(*arguments):
    return 7

NUMBER = 7
ROW = publishes("/ariac/{sensor}", "std_msgs/Float32", 10, ALWAYS, "x")
FAILING = SensorPlugin(fails, ROW, fails)
SEVEN = SensorPlugin(number, ROW, fails)
"""


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for installed packages, with the example in it."""
    folder = tmp_path / "site"
    folder.mkdir()
    install(folder)
    monkeypatch.syspath_prepend(str(folder))
    before = set(sys.modules)
    yield folder
    for name in set(sys.modules) - before:
        if name.partition(".")[0] in ("workshop", "broken", "odd"):
            del sys.modules[name]


@pytest.fixture
def others(site: Path) -> Path:
    """The folder with the example and with unusable packages."""
    (site / "broken.py").write_text(BROKEN)
    (site / "odd.py").write_text(ODD)
    groups = ("agents", "trials", "sensors", "devices")
    describe(site, "broken", {f"cellwright.{group}": {"broken": "broken:X"} for group in groups})
    describe(
        site,
        "odd",
        {
            "cellwright.agents": {"seven": "odd:NUMBER"},
            "cellwright.trials": {"failing": "odd:fails", "seven": "odd:number", "lesson": "odd:NUMBER"},
            "cellwright.sensors": {"failing": "odd:FAILING", "seven": "odd:SEVEN", "number": "odd:NUMBER"},
            "cellwright.devices": {"failing": "odd:fails", "seven": "odd:number", "number": "odd:NUMBER"},
        },
    )
    return site


@pytest.mark.usefixtures("site")
def test_plugin_names_are_found_without_import() -> None:
    assert plugins.names("agents") == ["watchman"]
    assert plugins.names("devices") == ["signal_lamp"]
    assert plugins.package("trials", "counting") == "workshop"
    assert "workshop" not in sys.modules


@pytest.mark.slow
@pytest.mark.usefixtures("site")
def test_example_plugins_run_together() -> None:
    cell = Cell(load_trial([find_trial("counting")]).trial)
    colours: list[str] = []
    cell.bus.subscribe("/workshop/lamp", lambda message: colours.append(message.data))
    result = run_cell(cell, find_agent("watchman")(), RunOptions(listen=["/ariac/counter"]))
    assert result.outcome.name == "DONE"
    assert result.heard == {"/ariac/counter": 20}
    assert colours[-4:] == ["yellow", "green", "yellow", "yellow"]


@pytest.mark.usefixtures("site")
def test_state_hash_covers_plugin_device() -> None:
    cell = Cell(load_trial([find_trial("counting")]).trial)
    before = cell.state_hash()
    lamp = cell.simulation.devices["lamp"]
    lamp.set_state({"colour": "red"})
    assert cell.state_hash() != before
    lamp.set_state({"colour": "yellow"})
    assert cell.state_hash() == before


@pytest.mark.slow
@pytest.mark.usefixtures("site")
def test_plugin_sensor_subscriber_does_not_change_state() -> None:
    def run(*, heard: bool) -> str:
        cell = Cell(load_trial([find_trial("counting")]).trial)
        if heard:
            cell.bus.subscribe("/ariac/counter", lambda _: None)
        for _ in range(200):
            cell.step()
        return cell.state_hash()

    assert run(heard=True) == run(heard=False)


@pytest.mark.usefixtures("others")
def test_broken_plugins_do_not_affect_others() -> None:
    assert find_trial("counting").name == "counting.yaml"
    assert isinstance(find_agent("watchman")(), Agent)
    assert find_trial("lesson").name == "lesson.yaml"
    assert load_trial([find_trial("counting")]).trial.devices[0].settings == {
        "topic": "/workshop/lamp",
        "running": "green",
    }


@pytest.mark.usefixtures("others")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("broken", "trial 'broken' of the package broken cannot be imported: ImportError: no such luck"),
        ("failing", "trial 'failing' of the package odd failed: ValueError: not today"),
        ("seven", "trial 'seven' of the package odd must be the path of a file (got int)"),
    ],
)
def test_unusable_plugin_trial_is_refused_with_reason(name: str, message: str) -> None:
    with pytest.raises(PluginError) as raised:
        find_trial(name)
    assert str(raised.value) == message


@pytest.mark.usefixtures("others")
def test_unusable_plugin_agent_is_refused_with_reason() -> None:
    with pytest.raises(PluginError, match="agent 'broken' of the package broken cannot be imported"):
        find_agent("broken")
    with pytest.raises(AgentError, match=r"agent seven: an agent is a class with a method run\(client\)"):
        find_agent("seven")
    with pytest.raises(AgentError, match=r"unknown agent 'watchmn'; did you mean watchman \(known: .*watchman\)"):
        find_agent("watchmn")


@pytest.mark.slow
@pytest.mark.usefixtures("others")
@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("broken", "cannot be imported: ImportError: no such luck"),
        ("failing", "cannot be made: ValueError: not today"),
        ("seven", "must make a "),
        ("number", "must be a "),
    ],
)
@pytest.mark.parametrize("group", ["sensor", "device"])
def test_unusable_plugin_sensor_or_device_is_refused_with_reason(group: str, kind: str, message: str) -> None:
    section = f"sensors: {{a: {{type: {kind}, pose: {{}}}}}}"
    if group == "device":
        section = f"cellwright: {{devices: {{a: {{type: {kind}}}}}}}"
    trial = load_trial(text=section).trial
    with pytest.raises(PluginError) as raised:
        Cell(trial)
    package = "broken" if kind == "broken" else "odd"
    assert str(raised.value).startswith(f"{group} '{kind}' of the package {package} {message}")


@pytest.mark.usefixtures("site")
def test_unknown_plugin_type_is_refused_with_suggestion() -> None:
    (warning,) = load_trial(text="sensors: {a: {type: part_countr, pose: {}}}").warnings
    assert "did you mean part_counter" in warning.message
    with pytest.raises(DescriptionError, match=r"unknown device type 'signal_lmp'; did you mean signal_lamp"):
        load_trial(text="cellwright: {devices: {a: {type: signal_lmp}}}")
    with pytest.raises(UnknownNameError, match="unknown trial 'countin'; did you mean counting"):
        find_trial("countin")


def test_device_type_without_plugins_is_refused() -> None:
    with pytest.raises(DescriptionError, match=r"unknown device type 'signal_lamp' \(known: none\)"):
        load_trial(text="cellwright: {devices: {a: {type: signal_lamp}}}")


def test_name_in_two_packages_is_refused(site: Path) -> None:
    describe(site, "second", {"cellwright.agents": {"watchman": "odd:NUMBER"}})
    with pytest.raises(PluginError, match="agent 'watchman' is in more than one package: second, workshop; uninstall"):
        find_agent("watchman")


@pytest.mark.slow
@pytest.mark.usefixtures("others")
def test_trials_command_warns_about_unusable_plugins(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trials"]) == 0
    out, err = capsys.readouterr()
    assert "of the package workshop" in out
    assert "counting" in out
    assert [line.partition(" of the package")[0] for line in err.splitlines()] == [
        "warning: trial 'broken'",
        "warning: trial 'failing'",
        "warning: trial 'lesson'",
        "warning: trial 'seven'",
    ]


FAILING_AT_WORK = """
from cellwright.engine.device import Device
import workshop.part_counter as workshop
from dataclasses import replace

class Late(Device):
    def __init__(self, name, settings, cell):
        super().__init__(name)
        self.when = settings

    def after_step(self):
        if self.simulation.time > 0.1 and self.when["at"] == "step":
            raise ZeroDivisionError("out of oil")

    def get_state(self):
        if self.simulation.time > 0.1 and self.when["at"] == "state":
            raise KeyError("oil")
        return {}

def message(reading, sensor):
    raise AttributeError("no such field")

def make(description, scene):
    sensor = workshop.PART_COUNTER.make(description, scene)
    def measure(index):
        raise OverflowError("too many")
    if description.name == "blind":
        sensor.measure = measure
    return sensor

COUNTER = replace(workshop.PART_COUNTER, make=make, message=message)
"""


@pytest.fixture
def late(site: Path) -> Path:
    """The folder with the example and with a package that fails at run time."""
    (site / "broken.py").write_text(FAILING_AT_WORK)
    described = {"cellwright.devices": {"late": "broken:Late"}, "cellwright.sensors": {"late": "broken:COUNTER"}}
    describe(site, "broken", described)
    return site


@pytest.mark.slow
@pytest.mark.usefixtures("late")
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "cellwright: {devices: {a: {type: late, at: step}}}",
            "device 'late' of the package broken failed in after_step: ZeroDivisionError: out of oil",
        ),
        (
            "sensors: {dumb: {type: late, pose: {}}}",
            "sensor 'late' of the package broken failed in message: AttributeError: no such field",
        ),
        (
            "sensors: {blind: {type: late, pose: {}}}",
            "sensor 'late' of the package broken failed in measure: OverflowError: too many",
        ),
    ],
)
def test_plugin_failure_at_run_time_names_its_package(text: str, message: str) -> None:
    class Waiting:
        def run(self, client: Client) -> None:
            client.sleep(10.0)

    cell = Cell(load_trial(text=text).trial)
    result = run_cell(cell, Waiting(), RunOptions(listen=["all"]))
    assert (result.outcome, result.error) == (Outcome.UNSTABLE, f"{message}\n")
    assert result.simulated < 1.0
