"""Loader of trials in the 2017 format: YAML to a raw trial, to a Trial, and to plain data for programs.

The way: texts joined -> YAML with places -> figures in the original's terms -> a `Trial`. What the original read is
read as it read it, with a warning for all that it passed over in silence; what it refused, and what means nothing, is
refused with everything that is wrong at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cellwright.config.layout import PART_TYPES, REFERENCE_FRAMES, TRAY_FRAMES
from cellwright.config.models.reader import OwnModels, read_own_models
from cellwright.config.parsing import expressions
from cellwright.config.parsing.raw_trial import (
    ZERO,
    Placement,
    RawBeltPart,
    RawDropRegion,
    RawOrder,
    RawPart,
    RawTrial,
    dictionary_order,
    kit_type,
    number_text,
    order_id,
)
from cellwright.config.parsing.reader import Key, Keys, Reader
from cellwright.config.parsing.sources import JoinedText, Text, read_texts
from cellwright.config.parsing.tree import Leaf, Node, Place, Problem, Problems, Table, described
from cellwright.config.parsing.yaml_source import parse
from cellwright.config.trial.orders import read_orders
from cellwright.config.trial.other_years import OtherYear
from cellwright.config.trial.parts import (
    PartBook,
    RawOptions,
    check_faulty,
    read_belt,
    read_bins,
    read_drops,
    read_extras,
    read_faulty,
    read_options,
)
from cellwright.config.trial.sensors import read_arm, read_cameras, read_plugin_devices, read_sensors
from cellwright.config.trial.settings import RawSettings, read_settings
from cellwright.config.trial.trial import (
    BeltPart,
    DropRegion,
    Kit,
    KitObject,
    Options,
    Order,
    Part,
    PluginDevice,
    Sensor,
    Trial,
)
from cellwright.util.errors import DescriptionError, UsageError
from cellwright.util.pose import Pose, Vector3, rpy_from_quaternion


def build_trial(
    name: str,
    figures: RawTrial,
    options: Options,
    sensors: tuple[Sensor, ...],
    own: RawSettings,
    models: OwnModels,
    devices: tuple[PluginDevice, ...],
    *,
    has_arm: bool,
) -> Trial:
    """The trial that the figures describe. Orders keep the order of their ids, belt parts that of their times."""
    return Trial(
        name=name,
        has_arm=has_arm,
        sensors=sensors,
        options=options,
        time_limit=float(figures.time_limit),
        orders=tuple(_build_order(index, order) for index, order in enumerate(figures.orders)),
        bin_parts=tuple(_build_part(model, "world") for model in figures.models),
        extra_parts=tuple(_build_part(model, model.origin) for model in figures.extra_models),
        belt_parts=tuple(BeltPart(float(part.time), part.type, part.placement.pose) for part in figures.belt),
        faulty_parts=frozenset(figures.faulty),
        drop_regions=tuple(_build_region(drop) for drop in figures.drops),
        material_locations={part_type: tuple(sorted(at)) for part_type, at in figures.material_locations.items()},
        settings=own.settings,
        initial_joint_states=own.initial_joint_states,
        part_models=models.parts,
        furniture=models.furniture,
        devices=devices,
    )


def _build_part(model: RawPart, frame: str) -> Part:
    return Part(model.name, model.type, model.placement.pose, frame)


def _build_order(index: int, order: RawOrder) -> Order:
    objects = tuple(KitObject(part_type, placement.pose) for part_type, placement in order.parts)
    # The original kept the whole part of a number of parts, and took one below 1 for no condition at all.
    count = int(order.value) if order.condition in ("wanted_parts", "unwanted_parts") and order.value >= 1 else None
    return Order(
        order_id=order_id(index),
        kits=tuple(Kit(kit_type(order.name, k), objects) for k in range(order.kit_count)),
        start_time=float(order.value) if order.condition == "time" else None,
        wanted_parts=count if order.condition == "wanted_parts" else None,
        unwanted_parts=count if order.condition == "unwanted_parts" else None,
        yaml_name=order.name,
    )


def _build_region(drop: RawDropRegion) -> DropRegion:
    lower, upper = _sorted(drop.first, drop.second)
    return DropRegion(drop.name, drop.type, lower, upper, drop.destination.pose)


def _sorted(first: Vector3, second: Vector3) -> tuple[Vector3, Vector3]:
    """The corner with the lesser and the one with the greater coordinates."""
    lower, upper = list(ZERO), list(ZERO)
    for axis in range(3):
        lower[axis], upper[axis] = sorted((first[axis], second[axis]))
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])


def resolved(figures: RawTrial) -> dict[str, Any]:
    """The figures as JSON-able data.

    Numbers have the 12 significant digits that the original's files had; the poses of orders and drop regions are
    texts, as there. Models are sorted by name, orders by their announcement.
    """
    data: dict[str, Any] = {
        "time_limit": figures.time_limit,
        "models": sorted([model.name, model.type, *_numbers(model.placement)] for model in figures.models),
        "belt": [[float(part.time), part.type, *_numbers(part.placement)] for part in figures.belt],
        "faulty": list(figures.faulty),
        "drop_regions": [
            {
                "type": drop.type,
                "min": _texts(drop.first),
                "max": _texts(drop.second),
                "destination": _pose_texts(drop.destination),
            }
            for drop in figures.drops
        ],
        "material_locations": {
            part_type: sorted(places) for part_type, places in sorted(figures.material_locations.items())
        },
        "orders": [_order_data(index, order) for index, order in _announced(figures)],
    }
    if figures.extra_models:
        data["extra_models"] = sorted(
            [model.name, model.type, model.origin, *_numbers(model.placement)] for model in figures.extra_models
        )
    return data


def resolved_cell(trial: Trial) -> dict[str, Any]:
    """What stands in the cell besides parts and orders, as JSON-able data: sensors, arm, options and what is one's own.

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


def _sensor_data(sensor: Sensor) -> dict[str, Any]:
    more = asdict(sensor)
    del more["pose"]
    return {**more, **_pose_data(sensor.pose)}


def _pose_data(pose: Pose) -> dict[str, list[float]]:
    xyz, rpy = pose.position, rpy_from_quaternion(pose.quaternion)
    return {"xyz": [float(number_text(v)) for v in xyz], "rpy": [float(number_text(v)) for v in rpy]}


def _announced(figures: RawTrial) -> list[tuple[int, RawOrder]]:
    """The orders by their start time; those without one come last, ties in the order of their ids."""

    def start(numbered: tuple[int, RawOrder]) -> float:
        return numbered[1].value if numbered[1].condition == "time" else math.inf

    return sorted(enumerate(figures.orders), key=start)


def _order_data(index: int, order: RawOrder) -> dict[str, Any]:
    objects = [{"type": part_type, "pose": _pose_texts(placement)} for part_type, placement in order.parts]
    return {
        "order_id": order_id(index),
        "yaml_name": order.name,
        "announcement_condition": order.condition,
        "announcement_condition_value": order.value,
        "kits": [{"kit_type": kit_type(order.name, k), "objects": objects} for k in range(order.kit_count)],
    }


def _numbers(placement: Placement) -> tuple[list[float], list[float]]:
    xyz, rpy = placement.xyz or ZERO, placement.rpy or ZERO
    return [float(number_text(v)) for v in xyz], [float(number_text(v)) for v in rpy]


def _texts(vector: Vector3 | None) -> list[str]:
    """Three numbers as texts; where the file says nothing, the original's default of whole zeros."""
    return ["0", "0", "0"] if vector is None else [number_text(v) for v in vector]


def _pose_texts(placement: Placement) -> dict[str, list[str]]:
    return {"xyz": _texts(placement.xyz), "rpy": _texts(placement.rpy)}


OWN = "cellwright"
"""The section that Cellwright adds."""

DEFAULT_TIME_LIMIT = 500

SECTIONS = Keys(
    Key("arm", "`{type: ur10}`", "there is an arm; every other entry is ignored", "no arm"),
    Key("sensors", "`{name: {type, pose}}`", "sensors, see below"),
    Key("options", "`{option: …}`", "what of the rest comes into the cell, see below", "see below"),
    Key("time_limit", "seconds", "after so long the trial is over; negative: never", DEFAULT_TIME_LIMIT),
    Key("orders", "`{name: {…}}`", "what is asked for, see below"),
    Key("models_over_bins", "`{bin: {models: {part type: grid}, xyz}}`", "grids of parts, see below"),
    Key("belt_parts", "`{part type: {seconds: {pose}}}`", "what the belt brings, see below"),
    Key(
        "faulty_parts",
        "list of names",
        "parts that earn nothing, without what stands before their last &#124;: `gear_part_3`, `gear_part_clone_0`",
    ),
    Key("drops", "`{drop_regions: {name: {…}}}`", "regions in which the gripper loses parts, see below"),
    Key("models_to_spawn", "`{frame: {models: {any name: {type, pose}}}}`", "single parts in the frames of links"),
)
"""The sections of the 2017 format."""

TOP_LEVEL = SECTIONS.names


@dataclass(frozen=True, slots=True)
class Loaded:
    """A trial, what the original's launcher would have made of its files, and what their author should know."""

    trial: Trial
    figures: RawTrial
    warnings: tuple[Problem, ...]


def load_trial(paths: Sequence[Path] = (), *, text: str | None = None) -> Loaded:
    """Load a trial from files, whose texts are joined in the order given, or from a text.

    Args:
        paths: the files; the trial is named after the first.
        text: the configuration itself, instead of files.

    Raises:
        DescriptionError: the configuration cannot be used; the error lists everything that was found wrong.
        UsageError: neither files nor a text, or both.
    """
    if bool(paths) == (text is not None):
        raise UsageError("a trial is loaded from files or from a text")
    joined = read_texts(paths) if text is None else JoinedText([Text("<text>", text)])
    problems = Problems()
    root = _top(parse(joined, problems), joined)
    trial, figures = _read(root, paths[0].stem if paths else "text", Reader(problems))
    return Loaded(trial, figures, problems.warnings)


def _top(root: Node | None, joined: JoinedText) -> Table:
    """The top level as a mapping; nothing at all is an empty one."""
    if root is None or (isinstance(root, Leaf) and root.value is None):
        return Table(Place(0, "", 0), "")
    if isinstance(root, Table):
        return root
    message = f"a configuration is a mapping of sections, not {described(root)}{joined.glue_hint(root.place)}"
    raise DescriptionError([Problem(root.place, "", message)])


def _read(root: Table, name: str, reader: Reader) -> tuple[Trial, RawTrial]:
    """Read all sections, and go on to what they come to only if no error was found."""
    expressions.check_expressions(root, reader.problems)
    other_year = OtherYear(root)
    for entry in root.entries.values():
        if entry.name not in TOP_LEVEL and entry.name != OWN:
            reader.problems.error(entry, other_year.top_level(entry.name, (*TOP_LEVEL, OWN)))

    node = root.get("options")
    options = read_options(node, reader) if node else RawOptions()
    models = read_own_models(root.get(OWN), reader)
    devices = read_plugin_devices(root.get(OWN), reader)
    book = PartBook(reader, options, PART_TYPES | models.parts.keys())
    bins, extras = _models(root, book)
    node = root.get("belt_parts")
    belt = read_belt(node, book, other_year) if node else ()
    node = root.get("drops")
    drops = read_drops(node, book) if node else ()
    node = root.get("orders")
    orders = read_orders(node, book, other_year) if node else ()
    node = root.get("faulty_parts")
    faulty = read_faulty(node, reader) if node else {}
    node = root.get("time_limit")
    time_limit = reader.number(node) if node else DEFAULT_TIME_LIMIT
    node = root.get("arm")
    has_arm = read_arm(node, reader) if node else False
    node = root.get("sensors")
    sensors: tuple[Sensor, ...] = read_sensors(node, reader) if node else ()
    sensors += read_cameras(root.get(OWN), sensors, reader, has_arm=has_arm)
    node = root.get(OWN)
    own = read_settings(node, reader) if node else RawSettings()
    if reader.problems.errors:
        raise DescriptionError(reader.problems.errors, reader.problems.warnings)

    figures = _figures(book, bins, extras, belt, tuple(faulty), drops, orders, time_limit)
    check_faulty(faulty, figures, options.options, reader)
    _warn_unused(root, options, orders, reader)
    return build_trial(name, figures, options.options, sensors, own, models, devices, has_arm=has_arm), figures


def _models(root: Table, book: PartBook) -> tuple[tuple[RawPart, ...], tuple[RawPart, ...]]:
    """The parts over the bins and the extra ones; whose numbers come first follows from the original's walk."""
    bins: tuple[RawPart, ...] = ()
    extras: tuple[RawPart, ...] = ()
    for name in dictionary_order(name for name in root.entries if name != OWN):
        node = root.get(str(name))
        if name == "models_over_bins" and node:
            bins = read_bins(node, book)
        elif name == "models_to_spawn" and node:
            extras = read_extras(node, book)
    return bins, extras


def _figures(
    book: PartBook,
    bins: Sequence[RawPart],
    extras: Sequence[RawPart],
    belt: Sequence[RawBeltPart],
    faulty: tuple[str, ...],
    drops: tuple[RawDropRegion, ...],
    orders: tuple[RawOrder, ...],
    time_limit: float | None,
) -> RawTrial:
    """What comes into the cell: what the options switch on and what there is a model for."""
    switches = book.options.options
    frames = set(REFERENCE_FRAMES) - (set() if switches.insert_agvs else set(TRAY_FRAMES))
    inserted = bins if switches.insert_models_over_bins else ()
    spawned = [part for part in extras if part.origin in frames] if switches.spawn_extra_models else []
    return RawTrial(
        time_limit=DEFAULT_TIME_LIMIT if time_limit is None else time_limit,
        models=tuple(part for part in inserted if part.type in book.types),
        extra_models=tuple(part for part in spawned if part.type in book.types),
        belt=tuple(part for part in belt if part.type in book.types),
        faulty=faulty,
        drops=drops,
        orders=orders,
        material_locations=_locations(bins, belt),
    )


def _locations(bins: Iterable[RawPart], belt: Iterable[RawBeltPart]) -> dict[str, frozenset[str]]:
    """Where each type can be found. The bins count even when their parts are not inserted."""
    places: dict[str, set[str]] = {"tray": {"agv1_load_point", "agv2_load_point"}}
    for part in belt:
        places.setdefault(part.type, set()).add("belt")
    for model in bins:
        places.setdefault(model.type, set()).add(model.origin)
    return {part_type: frozenset(units) for part_type, units in places.items()}


def _warn_unused(root: Table, options: RawOptions, orders: Sequence[RawOrder], reader: Reader) -> None:
    """Warn of sections that an option leaves without effect."""
    switches = options.options
    gates = (
        ("models_over_bins", switches.insert_models_over_bins, "insert_models_over_bins is true"),
        ("models_to_spawn", switches.spawn_extra_models, "spawn_extra_models is true"),
        ("belt_parts", switches.belt_population_cycles > 0, "belt_population_cycles is above 0"),
    )
    for name, is_used, condition in gates:
        entry = root.entries.get(name)
        is_empty = entry is None or (isinstance(entry.value, Table) and not entry.value.entries)
        if entry and not is_empty and not is_used:
            reader.problems.warn(entry, f"nothing of it comes into the cell unless options.{condition}")
    node = root.get("options")
    if node and switches.fill_demo_tray and not (orders and switches.insert_agvs):
        missing = "no tray" if orders else "no order"
        reader.problems.warn(node, f"fill_demo_tray has no effect, for there is {missing}")
