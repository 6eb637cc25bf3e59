"""Reference of configurations against the keys of the readers."""

import re
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import pytest
import yaml

from cellwright.config.arm import ArmSettings, JointGains, JointTolerance
from cellwright.config.layout import keys, tool_reader
from cellwright.config.parsing import entries
from cellwright.config.parsing.reader import Keys
from cellwright.config.robot import cameras, group_reader, robots
from cellwright.config.robot.robots import find_robot, load_robot
from cellwright.config.sensors import PictureCameraConfig, PictureNoise, SensorConfig
from cellwright.config.trial import (
    cell_sensors,
    gear2017,
    orders,
    parts,
    sensors,
    settings,
    short_orders,
    short_parts,
    task_reader,
    values,
)
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.task import Held, LinkAt, OnTray, Task, Turned
from cellwright.config.trial.trial import CellSettings, Options, Trial
from cellwright.util.errors import DescriptionError, UnknownNameError
from tests.config.trial.whole import WHOLE
from tools.configuration_pages import filled, tables

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ["configuration.md", "robot-configuration.md", "tasks.md"]
PLACES: dict[str, tuple[Keys, tuple[str, ...]]] = {
    "sections": (Keys(optional=dict.fromkeys(gear2017.TOP_LEVEL)), ()),
    "sensors": (sensors.SENSOR, ("sensors", "beam")),
    "options": (parts.OPTIONS, ("options",)),
    "orders": (orders.ORDER, ("orders", "order_0")),
    "parts": (parts.PART, ("orders", "order_0", "parts", "part_0")),
    "bins": (parts.BIN, ("models_over_bins", "bin9")),
    "grids": (parts.GRID, ("models_over_bins", "bin9", "models", "gear_part")),
    "extras": (parts.PART, ("models_to_spawn", "world", "models", "one")),
    "drop-regions": (parts.DROP_REGION, ("drops", "drop_regions", "one")),
    "own-arm": (settings.OWN_ARM, ("cellwright", "arm")),
    "gains": (settings.GAINS, ("cellwright", "arm", "gains", "elbow_joint")),
    "constraints": (values.CONSTRAINTS, ("cellwright", "arm", "constraints")),
    "tolerances": (values.TOLERANCE, ("cellwright", "arm", "constraints", "elbow_joint")),
}

REFERENCE: dict[str, tuple[Keys, str, type | None]] = {
    "sections": (PLACES["sections"][0], "", None),
    "sensors": (sensors.SENSOR, "", SensorConfig),
    "options": (parts.OPTIONS, "", Options),
    "orders": (orders.ORDER, "", None),
    "bins": (parts.BIN, "", None),
    "grids": (parts.GRID, "", None),
    "drop-regions": (parts.DROP_REGION, "", None),
    "extras": (parts.PART, "", None),
    "own": (settings.OWN, "", CellSettings),
    "own-arm": (settings.OWN_ARM, "arm.", ArmSettings),
    "gains": (settings.GAINS, "arm.gains.<joint>.", JointGains),
    "constraints": (values.CONSTRAINTS, "arm.constraints.", ArmSettings),
    "tolerances": (values.TOLERANCE, "arm.constraints.<joint>.", JointTolerance),
    "own-sensors": (sensors.CAMERA, "", PictureCameraConfig),
    "own-noise": (sensors.NOISE, "noise.", PictureNoise),
    "cell": (keys.CELL, "", None),
    "cell-frame": (keys.MOVE, "frame.", None),
    "cell-bins": (keys.BIN, "", None),
    "cell-belts": (keys.BELT, "", None),
    "cell-wall": (keys.WALL, "wall.", None),
    "cell-carriers": (keys.CARRIER, "", None),
    "cell-path": (keys.PATH, "path.", None),
    "cell-trays": (keys.TRAY, "", None),
    "cell-arms": (keys.ARM, "", None),
    "cell-mount": (keys.MOUNT, "mount.", None),
    "cell-tool": (tool_reader.TOOL, "tool.", None),
    "cell-pad": (tool_reader.PAD, "pad.", None),
    "cell-limits": (keys.JOINT_LIMITS, "", None),
    "cell-collision": (keys.COLLISION, "collision.", None),
    "cell-robots": (keys.ROBOT, "", None),
    "cell-hands": (keys.HANDS, "hands.", None),
    "cell-structure": (keys.STRUCTURE, "", None),
    "cell-blocks": (keys.BLOCK, "boxes[].", None),
    "cell-lines": (keys.LINE, "floor_lines[].", None),
    "cell-views": (keys.VIEW, "", None),
    "cell-places": (keys.FRAME, "", None),
    "cell-sensors": (cell_sensors.SENSOR, "", None),
    "task": (task_reader.TASK, "", Task),
    "task-start": (task_reader.START, "", None),
    "task-success": (task_reader.SUCCESS, "", None),
    "task-held": (task_reader.HELD, "held.", Held),
    "task-on-tray": (task_reader.ON_TRAY, "on_tray.", OnTray),
    "task-discarded": (task_reader.DISCARDED, "discarded.", None),
    "task-turned": (task_reader.TURNED, "turned.", Turned),
    "task-link-at": (task_reader.LINK_AT, "link_at.", LinkAt),
    "parts-in-bins": (short_parts.IN_BIN, "", None),
    "parts-on-belts": (short_parts.ON_BELT, "", None),
    "short-orders": (short_orders.SHORT_ORDER, "", None),
    "short-kits": (short_orders.KIT, "", None),
    "short-parts": (short_orders.SHORT_PART, "", None),
    "robot": (robots.ENTRIES, "", None),
    "robot-base-pose": (robots.BASE_POSES, "base_pose.", None),
    "robot-arms": (group_reader.ARMS, "arms[].", None),
    "robot-grippers": (group_reader.GRIPPERS, "grippers[].", None),
    "robot-controller": (robots.CONTROLLERS, "controller_indices.", None),
    "robot-cameras": (cameras.CAMERAS, "cameras[].", None),
}
"""Each table of entries on the pages: its keys, the prefix of their names, and the values with the defaults."""


@pytest.mark.parametrize("name", PAGES)
def test_configuration_page_is_up_to_date(name: str) -> None:
    page = (DOCS / name).read_text(encoding="utf-8")
    assert filled(page) == page, f"run: python -m tools.configuration_pages docs/{name}"


def test_table_is_on_one_page_once() -> None:
    names = [name for page in PAGES for name in re.findall(r"^<!-- made: (\S+) -->$", (DOCS / page).read_text(), re.M)]
    assert sorted(names) == sorted(tables())


def test_only_text_between_marks_is_replaced() -> None:
    page = "above\n<!-- made: robot-bounds -->\nold\n<!-- end -->\nbelow\n"
    table = tables()["robot-bounds"]
    assert filled(page) == f"above\n<!-- made: robot-bounds -->\n\n{table}\n<!-- end -->\nbelow\n"
    with pytest.raises(UnknownNameError, match="robot-bounds"):
        filled("<!-- made: robot-bound -->\n<!-- end -->\n")


def entries_on_pages() -> dict[str, dict[str, str]]:
    """Return the tables of entries on the pages: each entry with its default."""
    text = "".join((DOCS / page).read_text(encoding="utf-8") for page in PAGES)
    found = re.findall(r"<!-- entries: (\S+) -->(.*?)<!-- end -->", text, re.DOTALL)
    return {name: dict(re.findall(r"^\| `(\S+)` \|.*\| (.*) \|$", rows, re.MULTILINE)) for name, rows in found}


@pytest.mark.parametrize("name", REFERENCE)
def test_reference_has_entries_that_are_read(name: str) -> None:
    keys, prefix, made = REFERENCE[name]
    written = entries_on_pages()[name]
    assert sorted(written) == sorted(prefix + key for key in keys.names)
    assert {prefix + key for key in keys.required} == {key for key, default in written.items() if default == "required"}
    for field in fields(made) if made else ():
        if prefix + field.name in written and field.default not in (MISSING, None):
            assert written[prefix + field.name].strip("`") == default_text(field.default)


def default_text(default: object) -> str:
    """Return a default as the reference writes it."""
    if isinstance(default, tuple):
        return "/".join(map(str, default))
    return str(default).lower().removesuffix(".0")


def test_reference_has_each_table_of_entries_once() -> None:
    assert sorted(entries_on_pages()) == sorted(REFERENCE) == sorted(entries.tables())


@pytest.mark.parametrize("name", REFERENCE)
def test_keys_of_a_trial_have_their_texts(name: str) -> None:
    keys, _, _ = REFERENCE[name]
    assert not keys.texts or {*entries.texts(keys.texts)} == {*keys.names}


def test_trial_with_all_entries_is_valid() -> None:
    assert load_trial(text=yaml.safe_dump(WHOLE)).warnings == ()


OF_TASK = {"orders": {"kit", "score"}, "faulty_parts": {"discarded"}}
"""Conditions of a task that cannot hold without a section."""


def changed(place: tuple[str, ...], name: str, value: object = None, *, less: bool = False) -> str:
    """Return the whole trial with one entry added at a place, or one removed."""
    trial: dict[str, Any] = yaml.safe_load(yaml.safe_dump(WHOLE))
    body = trial
    for step in place:
        body = body[step]
    if less:
        body.pop(name, None)
        if not place and name in OF_TASK:
            trial["task"]["success"] = [each for each in WHOLE["task"]["success"] if OF_TASK[name].isdisjoint(each)]
    else:
        body[name] = value
    return yaml.safe_dump(trial)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "name"), [(place, name) for place, (keys, _) in PLACES.items() for name in keys.names]
)
def test_only_required_entries_are_mandatory(place: str, name: str) -> None:
    keys, where = PLACES[place]
    text = changed(where, name, less=True)
    if name in keys.required:
        with pytest.raises(DescriptionError, match=f"the required entry '{name}' is missing"):
            load_trial(text=text)
    else:
        load_trial(text=text)


@pytest.mark.parametrize("place", PLACES)
def test_undeclared_entries_are_unknown(place: str) -> None:
    try:
        messages = load_trial(text=changed(PLACES[place][1], "nonsense", 1)).warnings
    except DescriptionError as error:
        messages = error.problems  # type: ignore[assignment]
    assert any("nonsense" in str(problem) and "unknown" in str(problem) for problem in messages)


def test_declared_entries_have_fields() -> None:
    assert {*parts.OPTIONS.names} - {parts.ALIASES} == {field.name for field in fields(Options)}
    kept = {*settings.OWN_ARM.names, *values.CONSTRAINTS.names} - {"constraints", "initial_joint_states"}
    assert kept | {"tolerances"} == {field.name for field in fields(ArmSettings)}
    assert {"seed", "timestep", "collision_culling", "arm"} == {field.name for field in fields(CellSettings)}


def test_empty_trial_has_defaults_of_reference() -> None:
    trial = load_trial(text="").trial
    assert trial.options == Options()
    assert trial.settings == CellSettings()
    assert trial.time_limit == Trial("").time_limit
    assert entries_on_pages()["sections"]["time_limit"] == f"{trial.time_limit:g}"
    assert entries_on_pages()["own"]["timestep"] == "1/500"


def test_missing_required_robot_entry_is_refused(tmp_path: Path) -> None:
    text = find_robot("tandem").read_text()
    whole = yaml.safe_load(text)
    urdf = find_robot("tandem").parent / whole["urdf_path"]
    file = tmp_path / "vr_configs.yml"
    messages: list[str] = []
    for name in robots.ENTRIES.names:
        body = {**whole, "urdf_path": urdf.as_posix()}
        body.pop(name, None)
        if name == "arms":
            del body["controller_indices"]
        file.write_text(yaml.safe_dump(body))
        if name in robots.ENTRIES.required:
            with pytest.raises(DescriptionError, match=name):
                load_robot(file, messages.append)
        else:
            load_robot(file, messages.append)


@pytest.mark.parametrize(("group", "keys"), [("arms", group_reader.ARMS), ("grippers", group_reader.GRIPPERS)])
def test_missing_required_group_entry_is_refused(group: str, keys: Keys, tmp_path: Path) -> None:
    whole = yaml.safe_load(find_robot("tandem").read_text())
    urdf = find_robot("tandem").parent / whole["urdf_path"]
    file = tmp_path / "vr_configs.yml"
    for name in keys.required:
        body = yaml.safe_load(yaml.safe_dump({**whole, "urdf_path": urdf.as_posix()}))
        del body[group][0][name]
        file.write_text(yaml.safe_dump(body))
        with pytest.raises(DescriptionError, match=f"the required entry '{name}' is missing"):
            load_robot(file, print)
