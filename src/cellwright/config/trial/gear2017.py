"""Loader of trials in the 2017 format: YAML to a Trial, and to plain data for programs.

Texts are joined, parsed to YAML with places, and read into a `Trial`, whose values keep how they were written. The
loader reads entries as the original did, with a warning for everything that the original silently ignored. It refuses
what the original refused and what has no meaning, and lists all errors at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from cellwright.config.footprints import PART_TYPES
from cellwright.config.layout.arm_models import links_by_frame
from cellwright.config.layout.basing import CELL
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.layout import Layout
from cellwright.config.layout.reader import Cell, read_cell
from cellwright.config.parsing import expressions
from cellwright.config.parsing.overrides import Override, apply_overrides, refuse_without_effect
from cellwright.config.parsing.python2 import dictionary_order, number_text
from cellwright.config.parsing.reader import Placement, Reader
from cellwright.config.parsing.sources import JoinedText, Text, read_texts
from cellwright.config.parsing.tree import Entry, Place, Problem, Problems, Table, refusal
from cellwright.config.parsing.yaml_source import parse_mapping, refuse_lost_indentation
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial import parts
from cellwright.config.trial.cell_sensors import read_cell_sensors
from cellwright.config.trial.moving import moved
from cellwright.config.trial.orders import read_orders
from cellwright.config.trial.other_years import OtherYear
from cellwright.config.trial.sensors import read_arm, read_cameras, read_sensors, reserved_names
from cellwright.config.trial.settings import read_settings
from cellwright.config.trial.short_parts import ShortParts, read_parts
from cellwright.config.trial.task_reader import check_task, read_task
from cellwright.config.trial.trial import BeltPart, DropRegion, Options, Order, Trial
from cellwright.util.errors import DescriptionError, UsageError
from cellwright.util.pose import Pose, Vector3, rpy_from_quaternion

T = TypeVar("T")
OWN = "cellwright"
"""Name of the section that Cellwright adds."""
DEFAULT_TIME_LIMIT = 500
TOP_LEVEL = (
    *("arm", "sensors", "options", "time_limit", "orders", "models_over_bins", "belt_parts", "faulty_parts"),
    *("drops", "models_to_spawn"),
)
"""Sections of the 2017 format."""
PARTS = "parts"
"""Name of the section of parts in bins and on belts, in short."""
TASK = "task"
"""Name of the section with what is to be done."""
KNOWN = (*TOP_LEVEL, CELL, PARTS, TASK, OWN)
"""Sections of a trial."""


@dataclass(frozen=True, slots=True)
class Loaded:
    """Trial with the warnings for its file's author.

    `time_limit` [s] and `faulty_parts` are as in the original's launcher: a number of the kind that the file has,
    negative for no limit, and the names in the order of its dictionary. The places of the entries of
    `cell` and of sensors are in `places`, by dotted path; without the section `cell` it is empty.
    """

    trial: Trial
    warnings: tuple[Problem, ...]
    time_limit: float
    faulty_parts: tuple[str, ...]
    places: Mapping[str, Place] = field(default_factory=dict)


def load_trial(paths: Sequence[Path] = (), *, text: str | None = None, overrides: Sequence[Override] = ()) -> Loaded:
    """Load a trial from files, whose texts are joined in the order given, or from a text.

    Args:
        paths: the files; the trial is named after the first.
        text: the configuration itself, instead of files.
        overrides: values that replace those of the files. What the trial would ignore with a warning is an error.

    Raises:
        DescriptionError: the configuration cannot be used; the error lists everything that is wrong.
        UsageError: neither files nor a text, or both.

    Example:
        >>> loaded = load_trial(text="{time_limit: 60, options: {insert_agv: true}}")
        >>> loaded.trial.time_limit
        60.0
        >>> print(loaded.warnings[0])
        <text>:1: options.insert_agv: unknown option, ignored; did you mean insert_agvs
    """
    if bool(paths) == (text is not None):
        raise UsageError("load_trial requires either paths or text")
    joined = read_texts(paths) if text is None else JoinedText([Text("<text>", text)])
    problems = Problems()
    root = parse_mapping(joined, problems, "a configuration must be a mapping of sections")
    if paths and not root.entries and not joined.has_content:
        message = "the file is empty, or has comments only; write the sections of a trial, or {} for an empty cell"
        raise refusal(paths[0], 0, message)
    refuse_lost_indentation(root, KNOWN)
    root = apply_overrides(root, overrides, problems)
    trial, time_limit, faulty = _read(root, paths[0].stem if paths else "text", Reader(problems), overrides)
    return Loaded(trial, problems.warnings, time_limit, faulty, _places(root))


def resolved(loaded: Loaded) -> dict[str, Any]:
    """Return the original launcher's result for a trial's files, as JSON-able data.

    Numbers have the 12 significant digits of the original's files; the poses of orders and drop regions are texts, as
    there. Models are sorted by name, orders by their announcement.
    """
    trial = loaded.trial
    orders = sorted(trial.orders, key=lambda order: math.inf if order.start_time is None else order.start_time)
    data: dict[str, Any] = {
        "time_limit": loaded.time_limit,
        "models": sorted([part.name, part.type, *_numbers(part.written)] for part in trial.bin_parts),
        "belt": [[part.time, part.type, *_numbers(part.written)] for part in trial.belt_parts],
        "faulty": list(loaded.faulty_parts),
        "drop_regions": [_drop_data(drop) for drop in trial.drop_regions],
        "material_locations": {kind: list(places) for kind, places in sorted(trial.material_locations.items())},
        "orders": [_order_data(order) for order in orders],
    }
    if trial.extra_parts:
        data["extra_models"] = sorted(
            [part.name, part.type, part.frame, *_numbers(part.written)] for part in trial.extra_parts
        )
    return data


def resolved_cell(trial: Trial) -> dict[str, Any]:
    """Return the cell without parts and orders, as JSON-able data: sensors, arm, options and user-defined models.

    Angles are roll, pitch and yaw [rad]; poses are in the world frame, a camera's in its `frame`.
    """
    arm = asdict(trial.settings.arm) | {"initial_joint_states": dict(trial.initial_joint_states)}
    return {
        "sensors": [_sensor_data(sensor) for sensor in trial.sensors],
        "arm": arm if trial.has_arm else None,
        "options": asdict(trial.options),
        "seed": trial.settings.seed,
        "timestep": trial.settings.timestep[0] / trial.settings.timestep[1],
        "part_types": sorted(trial.part_models),
        "furniture": [{"name": each.name, **_pose_data(each.pose)} for each in trial.furniture],
        "devices": [{"name": each.name, "type": each.type} for each in trial.devices],
    }


def _read(
    root: Table, name: str, reader: Reader, overrides: Sequence[Override]
) -> tuple[Trial, float, tuple[str, ...]]:
    """Read all sections, and build the trial only if there was no error."""
    expressions.check_expressions(root, reader.problems)
    other_year = OtherYear(root)
    is_later = isinstance(root.get(PARTS), Table)
    for entry, similar in reader.unknown(root, tuple(name for name in KNOWN if name != PARTS or not is_later)):
        message = other_year.top_level_message(entry.name, KNOWN) if similar else "unknown top-level entry"
        reader.problems.error(entry, message)

    def section(name: str, read: Callable[..., T], *more: object) -> T | None:
        node = root.get(name)
        return read(node, *more) if node else None

    options, aliases = section("options", parts.read_options, reader) or (Options(), parts.DEFAULT_ALIASES)
    own = section(OWN, read_settings, reader) or {}
    types = PART_TYPES | own.get("part_models", {}).keys()
    cell = _cell(root, reader, types, overrides)
    layout = cell.layout
    _refuse_original_drives(root, cell, reader)
    _check_part_types(root, layout, reader)
    registry = parts.PartRegistry(reader, options, aliases, types, layout)
    readers = {"models_over_bins": parts.read_bins, "models_to_spawn": parts.read_extras}
    # The original's parser walks sections in the order of Python 2's dictionaries, and numbers parts as it meets them.
    walked = dictionary_order(name for name in root.entries if name != OWN)
    models = {name: readers[str(name)](root.entries[name].value, registry) for name in walked if name in readers}
    bins, extras = (models.get(name, ()) for name in readers)
    belt = section("belt_parts", parts.read_belt, registry, other_year) or ()
    time_limit = section("time_limit", reader.number)
    time_limit = DEFAULT_TIME_LIMIT if time_limit is None else time_limit
    short = (
        None if is_later else section(PARTS, read_parts, registry, cell, None if time_limit < 0 else float(time_limit))
    )
    short = short or ShortParts()
    drops = section("drops", parts.read_drops, registry) or ()
    orders = section("orders", read_orders, registry, other_year) or ()
    faulty = section("faulty_parts", parts.read_faulty, reader) or {}
    has_arm = section("arm", read_arm, reader) or False
    if has_arm and not layout.arms:
        message = "the cell has no place for an arm; write cell: arms: {arm: {mount: {kind: rail, at: [x, y]}}}"
        reader.problems.error(root.entries["arm"], message)
    has_arm = has_arm or cell.has_arm
    reserved = reserved_names(layout)
    sensors: tuple[SensorConfig, ...] = section("sensors", read_sensors, reserved, reader) or ()
    sensors += read_cell_sensors(cell, sensors, reader)
    links = links_by_frame(layout.arms if has_arm else (), cell.arm_models)
    sensors += section(OWN, partial(read_cameras, frames=links), sensors, reserved, reader) or ()
    task = section(TASK, read_task, reader)
    _raise_errors(overrides, reader.problems)

    frames = Trial(name, options=options, layout=layout).reference_frames
    inserted = bins if options.insert_models_over_bins else ()
    spawned = [part for part in extras if part.frame in frames] if options.spawn_extra_models else []
    trays = {each.location for each in layout.stations}
    locations = ({"tray": trays} if trays else {}) | registry.locations
    trial = Trial(
        name=name,
        has_arm=has_arm,
        sensors=sensors,
        options=options,
        time_limit=None if time_limit < 0 else float(time_limit),
        orders=orders,
        bin_parts=tuple(part for part in (*inserted, *short.in_bins) if part.type in types),
        extra_parts=tuple(part for part in spawned if part.type in types),
        belt_parts=tuple(part for part in _by_time(belt, short.on_belts) if part.type in types),
        faulty_parts=frozenset(faulty),
        drop_regions=drops,
        material_locations={kind: tuple(sorted(places)) for kind, places in locations.items()},
        overrides=tuple(map(str, overrides)),
        layout=layout,
        arm_models=cell.arm_models,
        robot_models=cell.robot_models,
        task=None if task is None else task.task,
        **own,
    )
    parts.check_faulty(faulty, trial, reader)
    if task is not None:
        check_task(task, trial, reader)
    _warn_unused(root, trial, reader)
    _raise_errors(overrides, reader.problems)
    # all sections are in the frame of the cell
    return trial if cell.moved_by == Pose() else moved(trial, cell.moved_by), time_limit, tuple(faulty)


def _refuse_original_drives(root: Table, cell: Cell, reader: Reader) -> None:
    """Refuse settings of 2017's arm where an arm has a model of its own, and one posture for several arms."""
    own = root.get(OWN)
    arm = own.get("arm") if isinstance(own, Table) else None
    if not isinstance(arm, Table):
        return
    for name in ("servo", "gains", "dry_friction", "initial_joint_states"):
        if cell.arm_models and name in arm.entries:
            message = "is of the UR10 of 2017; the entry of an arm with a model has home and bandwidth"
            reader.problems.error(arm.entries[name], message)
        elif name == "initial_joint_states" and name in arm.entries and any(a.namespace for a in cell.layout.arms):
            reader.problems.error(arm.entries[name], "the arms have namespaces; give each its home in cell: arms:")


def _by_time(belt: Sequence[BeltPart], short: Sequence[BeltPart]) -> Sequence[BeltPart]:
    """Return all parts of belts by their times; those of the 2017 format keep the original's order of ties."""
    return sorted((*belt, *short), key=lambda part: part.time) if short else belt


def _cell(root: Table, reader: Reader, types: Collection[str], overrides: Sequence[Override]) -> Cell:
    """Return the cell: that of the section `cell`, or that of 2017."""
    entry = root.entries.get(CELL)
    if entry is None:
        return Cell(gear2017())
    table = reader.table(entry.value)
    cell = read_cell(table, reader, types) if table else None
    if cell is None:
        _raise_errors(overrides, reader.problems)
        raise AssertionError
    return cell


def _check_part_types(root: Table, layout: Layout, reader: Reader) -> None:
    """Refuse part types with the name of an AGV that the file does not describe: cameras report both by their names.

    For names of the file's own section `cell` its reader has done so.
    """
    own, cell = root.get(OWN), root.get(CELL)
    types = own.get(PARTS) if isinstance(own, Table) else None
    described = cell.get("carriers") if isinstance(cell, Table) else None
    written = described.entries if isinstance(described, Table) else {}
    entries = types.entries if isinstance(types, Table) else {}
    for name in (each.name for each in layout.carriers):
        if name in entries and name not in written:
            reader.problems.error(entries[name], f"the model name {name!r} is in use; choose another")


def _places(root: Table) -> dict[str, Place]:
    """Return the places of the entries of a cell of one's own, and of its sensors."""
    if CELL not in root.entries:
        return {}
    return {entry.key: entry.place for name in (CELL, "sensors") for entry in _entries(root.entries.get(name))}


def _entries(entry: Entry | None) -> Iterator[Entry]:
    """Yield an entry and all below it."""
    if entry is not None:
        yield entry
        for each in entry.value.entries.values() if isinstance(entry.value, Table) else ():
            yield from _entries(each)


def _raise_errors(overrides: Sequence[Override], problems: Problems) -> None:
    refuse_without_effect(overrides, problems)
    if problems.errors:
        raise DescriptionError(problems.errors, problems.warnings)


def _warn_unused(root: Table, trial: Trial, reader: Reader) -> None:
    """Warn of sections that an option disables."""
    switches = trial.options
    gates = (
        ("models_over_bins", switches.insert_models_over_bins, "insert_models_over_bins is true"),
        ("models_to_spawn", switches.spawn_extra_models, "spawn_extra_models is true"),
        ("belt_parts", switches.belt_population_cycles > 0, "belt_population_cycles is above 0"),
    )
    for name, is_used, condition in gates:
        entry = root.entries.get(name)
        is_empty = entry is None or (isinstance(entry.value, Table) and not entry.value.entries)
        if entry and not is_empty and not is_used:
            reader.problems.warn(entry, f"no effect on the cell unless options.{condition}", ignored=entry)
    node = root.get("options")
    if isinstance(node, Table) and switches.fill_demo_tray and not (trial.orders and switches.insert_agvs):
        missing = "a tray" if trial.orders else "an order"
        entry = node.entries["fill_demo_tray"]
        reader.problems.warn(entry, f"no effect without {missing}", ignored=entry)


def _sensor_data(sensor: SensorConfig) -> dict[str, Any]:
    more = asdict(sensor)
    del more["pose"]
    return {**more, **_pose_data(sensor.pose)}


def _pose_data(pose: Pose) -> dict[str, list[float]]:
    xyz, rpy = pose.position, rpy_from_quaternion(pose.quaternion)
    return {"xyz": [float(number_text(v)) for v in xyz], "rpy": [float(number_text(v)) for v in rpy]}


def _order_data(order: Order) -> dict[str, Any]:
    condition, value = order.written or ("", 0.0)
    return {
        "order_id": order.order_id,
        "yaml_name": order.yaml_name,
        "announcement_condition": condition,
        "announcement_condition_value": value,
        "kits": [
            {
                "kit_type": kit.kit_type,
                "objects": [{"type": each.type, "pose": _pose_texts(each.written)} for each in kit.objects],
            }
            for kit in order.kits
        ],
    }


def _drop_data(drop: DropRegion) -> dict[str, Any]:
    first, second, destination = drop.written or (drop.lower, drop.upper, Placement())
    return {"type": drop.type, "min": _texts(first), "max": _texts(second), "destination": _pose_texts(destination)}


def _numbers(placement: Placement | None) -> tuple[list[float], list[float]]:
    placed, zero = placement or Placement(), (0.0, 0.0, 0.0)
    return [float(number_text(v)) for v in placed.xyz or zero], [float(number_text(v)) for v in placed.rpy or zero]


def _texts(vector: Vector3 | None) -> list[str]:
    """Return three numbers as texts; without a value, the original's default of whole zeros."""
    return ["0", "0", "0"] if vector is None else [number_text(v) for v in vector]


def _pose_texts(placement: Placement | None) -> dict[str, list[str]]:
    placed = placement or Placement()
    return {"xyz": _texts(placed.xyz), "rpy": _texts(placed.rpy)}
