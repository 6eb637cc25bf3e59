"""What else one may want to see of a cell or a robot: its sensors and what they find, its tools, what touches what."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.cell import Cell
from cellwright.cell.devices.sensors import break_beam, laser_profiler, proximity
from cellwright.cell.devices.sensors.break_beam import BeamReading
from cellwright.cell.devices.sensors.laser_profiler import ProfileReading
from cellwright.cell.devices.sensors.logical_camera import CameraReading, LogicalCamera
from cellwright.cell.devices.sensors.proximity import ProximityReading
from cellwright.cell.model.arm import CUP_GEOM
from cellwright.engine.sensor import Reading, Sensor
from cellwright.middleware.bus.served import Served
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.rendering.scene.taking import SceneTaker
from cellwright.robot.model.robot import body_of
from cellwright.robot.node import RobotNode
from cellwright.util.pose import Pose

MOST_CONTACTS = 300
"""So many contacts are told, the strongest first."""

_WEAKEST = 1e-3  # [N]
_EVERY = 8  # of the rays of a profile, this one is told
_FARTHEST_SHOWN = 1.0  # [m] of what cameras see; the rest would fill the cell with lines
_HERE = (0.0, 0.0, 0.0)


def about(served: Served, taker: SceneTaker) -> dict[str, Any]:
    """What stays as it is: `kind`, `sensors` with their places and figures, `tools` as [body, [x, y, z]]."""
    if isinstance(served, Cell):
        sensors = [_described(each) for each in served.sensors.values()]
        return {"kind": "cell", "sensors": sensors, "tools": _cup(served, taker)}
    if isinstance(served, RobotNode):
        model = served.simulation.model
        bodies = [taker.index(model.body(body_of(arm.tip)).id) for arm in served.config.arms]
        return {"kind": "robot", "sensors": [], "tools": [[body, _HERE] for body in bodies if body]}
    return {"kind": "recording", "sensors": [], "tools": []}


def _cup(cell: Cell, taker: SceneTaker) -> list[Any]:
    if cell.gripper is None:
        return []
    geom = cell.simulation.model.geom(CUP_GEOM)
    body = taker.index(int(geom.bodyid[0]))
    return [[body, geom.pos.tolist()]] if body else []


def _described(sensor: Sensor[Any]) -> dict[str, Any]:
    pose = sensor.world_T_sensor
    found = {"name": sensor.name, "position": pose.position, "quaternion": pose.quaternion}
    match sensor:
        case break_beam.BreakBeam():
            return found | {"form": "beam", "near": break_beam.BEAM_START, "far": break_beam.BEAM_LENGTH}
        case proximity.ProximitySensor():
            figures = {"near": proximity.CONE_START, "far": proximity.MAX_RANGE, "angle": proximity.HALF_ANGLE}
            return found | {"form": "cone", **figures}
        case laser_profiler.LaserProfiler():
            source = pose @ Pose((0.0, 0.0, laser_profiler.FAN_HEIGHT))
            figures = {"near": 0.0, "far": laser_profiler.MAX_RANGE, "angle": laser_profiler.HALF_ANGLE}
            return found | {"form": "fan", "position": source.position, **figures}
        case LogicalCamera():
            figures = {"near": sensor.near, "far": sensor.far, "angle": sensor.horizontal_fov / 2}
            return found | {"form": "frustum", "aspect": sensor.aspect, **figures}
        case PictureCamera():
            angle, far = sensor.pinhole.fov / 2, min(sensor.description.far, _FARTHEST_SHOWN)
            place = _place(sensor.world_T_camera)
            figures = {"near": min(sensor.description.near, far), "far": far, "angle": angle}
            return found | {
                "form": "frustum",
                "aspect": sensor.pinhole.width / sensor.pinhole.height,
                **figures,
                **place,
            }
        case _:
            return found | {"form": "other"}


def _place(pose: Pose) -> dict[str, Any]:
    return {
        "position": [round(each, 4) for each in pose.position],
        "quaternion": [round(each, 5) for each in pose.quaternion],
    }


def sensors(served: Served) -> dict[str, Any]:
    """What the sensors of a cell find now, by name; None for one that is switched off or of a form of its own.

    Each is `sees`, whether there is something, and `ranges` [m] along its rays, null for one that meets nothing. A
    reading is a function of state and time, so nobody finds out that it was made. A camera that takes pictures tells
    where it is, `position` and `quaternion`; none is drawn for that.
    """
    if not isinstance(served, Cell):
        return {}
    return {name: _found(sensor) if sensor.enabled else None for name, sensor in served.sensors.items()}


def _found(sensor: Sensor[Any]) -> dict[str, Any] | None:
    if isinstance(sensor, PictureCamera):
        return {"sees": False, "ranges": [], **_place(sensor.world_T_camera)}
    if not isinstance(
        sensor, (break_beam.BreakBeam, proximity.ProximitySensor, laser_profiler.LaserProfiler, LogicalCamera)
    ):
        return None  # one of another package may do whatever it likes when it is read
    reading: Reading = sensor.read()
    match reading:
        case BeamReading(detected=detected, range=length):
            return {"sees": detected, "ranges": [_finite(length)]}
        case ProximityReading(range=length):
            return {"sees": length < proximity.MAX_RANGE, "ranges": [_finite(length)]}
        case ProfileReading(ranges=ranges):
            return {"sees": bool(np.isfinite(ranges).any()), "ranges": [_finite(each) for each in ranges[::_EVERY]]}
        case CameraReading(detections=detections):
            return {"sees": bool(detections), "ranges": []}
        case _:
            return None


def _finite(length: float) -> float | None:
    return round(float(length), 4) if math.isfinite(length) else None


def contacts(served: Served) -> list[list[float]]:
    """Where things touched in the last step: [x, y, z, fx, fy, fz], places [m] and forces [N] in the world."""
    model, data = served.simulation.model, served.simulation.data
    found: list[tuple[float, list[float]]] = []
    force = np.empty(6)
    for number in range(data.ncon):
        mujoco.mj_contactForce(model, data, number, force)
        contact = data.contact[number]
        strength = float(np.linalg.norm(force[:3]))
        if strength > _WEAKEST and math.isfinite(strength):
            world = contact.frame.reshape(3, 3).T @ force[:3]
            found.append((strength, [round(value, 4) for value in (*contact.pos.tolist(), *world.tolist())]))
    found.sort(key=lambda each: -each[0])
    return [row for _, row in found[:MOST_CONTACTS]]
