"""From figures in the original's terms to a `Trial`: poses, sorted boxes, ids of orders and kits."""

from __future__ import annotations

from cellwright.config.models.section import OwnModels
from cellwright.config.parsing.figures import ZERO, DropFigure, Figures, ModelFigure, OrderFigure, kit_type, order_id
from cellwright.config.trial.settings import SettingFigures
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
from cellwright.util.pose import Vector3


def trial_of(
    name: str,
    figures: Figures,
    options: Options,
    sensors: tuple[Sensor, ...],
    own: SettingFigures,
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
        orders=tuple(_order(index, order) for index, order in enumerate(figures.orders)),
        bin_parts=tuple(_part(model, "world") for model in figures.models),
        extra_parts=tuple(_part(model, model.origin) for model in figures.extra_models),
        belt_parts=tuple(BeltPart(float(part.time), part.type, part.placement.pose) for part in figures.belt),
        faulty_parts=frozenset(figures.faulty),
        drop_regions=tuple(_region(drop) for drop in figures.drops),
        material_locations={part_type: tuple(sorted(at)) for part_type, at in figures.material_locations.items()},
        settings=own.settings,
        initial_joint_states=own.initial_joint_states,
        part_models=models.parts,
        furniture=models.furniture,
        devices=devices,
    )


def _part(model: ModelFigure, frame: str) -> Part:
    return Part(model.name, model.type, model.placement.pose, frame)


def _order(index: int, order: OrderFigure) -> Order:
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


def _region(drop: DropFigure) -> DropRegion:
    lower, upper = _sorted(drop.first, drop.second)
    return DropRegion(drop.name, drop.type, lower, upper, drop.destination.pose)


def _sorted(first: Vector3, second: Vector3) -> tuple[Vector3, Vector3]:
    """The corner with the lesser and the one with the greater coordinates."""
    lower, upper = list(ZERO), list(ZERO)
    for axis in range(3):
        lower[axis], upper[axis] = sorted((first[axis], second[axis]))
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])
