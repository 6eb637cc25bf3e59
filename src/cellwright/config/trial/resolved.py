"""What a configuration comes to, as plain data for other programs: names, world poses, schedules, orders."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from cellwright.config.parsing.figures import ZERO, Figures, OrderFigure, Placement, kit_type, order_id
from cellwright.config.parsing.python2 import number_text
from cellwright.config.trial.trial import Sensor, Trial
from cellwright.util.pose import Pose, Vector3, rpy_from_quaternion


def resolved(figures: Figures) -> dict[str, Any]:
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
        "orders": [_order(index, order) for index, order in _announced(figures)],
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
        "sensors": [_sensor(sensor) for sensor in trial.sensors],
        "arm": arm if trial.has_arm else None,
        "options": asdict(trial.options),
        "seed": trial.settings.seed,
        "timestep": trial.settings.timestep[0] / trial.settings.timestep[1],
        "part_types": sorted(trial.part_models),
        "furniture": [{"name": each.name, **_pose(each.pose)} for each in trial.furniture],
        "devices": [{"name": each.name, "type": each.type} for each in trial.devices],
    }


def _sensor(sensor: Sensor) -> dict[str, Any]:
    more = asdict(sensor)
    del more["pose"]
    return {**more, **_pose(sensor.pose)}


def _pose(pose: Pose) -> dict[str, list[float]]:
    xyz, rpy = pose.position, rpy_from_quaternion(pose.quaternion)
    return {"xyz": [float(number_text(v)) for v in xyz], "rpy": [float(number_text(v)) for v in rpy]}


def _announced(figures: Figures) -> list[tuple[int, OrderFigure]]:
    """The orders by their start time; those without one come last, ties in the order of their ids."""

    def start(numbered: tuple[int, OrderFigure]) -> float:
        return numbered[1].value if numbered[1].condition == "time" else math.inf

    return sorted(enumerate(figures.orders), key=start)


def _order(index: int, order: OrderFigure) -> dict[str, Any]:
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
