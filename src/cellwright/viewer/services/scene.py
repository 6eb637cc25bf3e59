"""Scene service, frame service with sensor and contact overlays, and the offer of all services for viewers.

| service | asked | answer |
|---|---|---|
| `cellwright/scene` | | `scene`: base64 of `encode_scene`; `digest`: their SHA-256; `about`: see `sights.about` |
| `cellwright/frame` | see below | `time` [ns], `tick`, `run`, `digest`; `frame`: base64 of `Frame.encode`, whole |
| | `sensors`: true | `sensors`: see `sights.sensors` |
| | `contacts`: true | `contacts`: see `sights.contacts` |

Nobody is told anything who does not ask, and an answer leaves the state as it is.
"""

from __future__ import annotations

import hashlib
import math
from base64 import b64encode
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.cell import Cell
from cellwright.cell.devices import range_sensors
from cellwright.cell.devices.logical_camera import CameraReading, LogicalCamera
from cellwright.cell.devices.range_sensors import BeamReading, ProfileReading, ProximityReading
from cellwright.cell.model.arm import CUP_GEOM
from cellwright.engine.sensor import Reading, Sensor
from cellwright.middleware.bus import Served
from cellwright.middleware.server import Server
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.rendering.scene.engine import SceneTaker
from cellwright.rendering.scene.scene import encode_scene
from cellwright.robot.model import body_of
from cellwright.robot.node import RobotNode
from cellwright.util.pose import Pose
from cellwright.viewer.services.control import Control, Tell, offer_panel
from cellwright.viewer.services.names import FOR_ONLOOKERS, FRAME, SCENE

MOST_CONTACTS = 300
"""So many contacts are told, the strongest first."""

_WEAKEST = 1e-3  # [N]
_EVERY = 8  # of the rays of a profile, this one is told
_FARTHEST_SHOWN = 1.0  # [m] of what cameras see; the rest would fill the cell with lines
_HERE = (0.0, 0.0, 0.0)


def scene_metadata(served: Served, taker: SceneTaker) -> dict[str, Any]:
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
        case range_sensors.BreakBeam():
            return found | {"form": "beam", "near": range_sensors.BEAM_START, "far": range_sensors.BEAM_LENGTH}
        case range_sensors.ProximitySensor():
            figures = {
                "near": range_sensors.CONE_START,
                "far": range_sensors.PROXIMITY_MAX_RANGE,
                "angle": range_sensors.CONE_HALF_ANGLE,
            }
            return found | {"form": "cone", **figures}
        case range_sensors.LaserProfiler():
            source = pose @ Pose((0.0, 0.0, range_sensors.FAN_HEIGHT))
            figures = {"near": 0.0, "far": range_sensors.PROFILER_MAX_RANGE, "angle": range_sensors.FAN_HALF_ANGLE}
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


def sensor_readings(served: Served) -> dict[str, Any]:
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
        sensor, (range_sensors.BreakBeam, range_sensors.ProximitySensor, range_sensors.LaserProfiler, LogicalCamera)
    ):
        return None  # one of another package may do whatever it likes when it is read
    reading: Reading = sensor.read()
    match reading:
        case BeamReading(detected=detected, range=length):
            return {"sees": detected, "ranges": [_finite(length)]}
        case ProximityReading(range=length):
            return {"sees": length < range_sensors.PROXIMITY_MAX_RANGE, "ranges": [_finite(length)]}
        case ProfileReading(ranges=ranges):
            return {"sees": bool(np.isfinite(ranges).any()), "ranges": [_finite(each) for each in ranges[::_EVERY]]}
        case CameraReading(detections=detections):
            return {"sees": bool(detections), "ranges": []}
        case _:
            return None


def _finite(length: float) -> float | None:
    return round(float(length), 4) if math.isfinite(length) else None


def contact_forces(served: Served) -> list[list[float]]:
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


@dataclass(frozen=True)
class _Taken:
    """A scene as it is told."""

    taker: SceneTaker
    text: str
    digest: str


class SceneServices:
    """Tells what is to be seen of what is served.

    Args:
        served: a cell, a robot's node, or a recording.
    """

    def __init__(self, served: Served) -> None:
        self._served = served

    def offer(self, server: Server) -> None:
        """Answer on a server."""
        server.offer(SCENE, self.scene)
        server.offer(FRAME, self.frame)

    def scene(self, _asked: dict[str, Any]) -> dict[str, Any]:
        """What there is to be seen."""
        taken = self._taken
        return {"scene": taken.text, "digest": taken.digest, "about": scene_metadata(self._served, taken.taker)}

    def frame(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Where it is now."""
        simulation = self._served.simulation
        simulation.refresh()
        frame = self._taken.taker.frame(simulation.data, simulation.now)
        extras: dict[str, Any] = {}
        if asked.get("contacts") is True:
            extras["contacts"] = contact_forces(self._served)
        if asked.get("sensors") is True:
            extras["sensors"] = sensor_readings(self._served)
        return extras | {
            "time": simulation.now,
            "tick": simulation.clock.tick,
            "run": simulation.runs,
            "digest": self._taken.digest,
            "frame": b64encode(frame.encode()).decode(),
        }

    @cached_property
    def _taken(self) -> _Taken:
        """Made when somebody asks for the first time: most that is served is never looked at."""
        taker = SceneTaker(self._served.simulation.model, name=self._served.name, hidden=self._served.out_of_sight)
        data = encode_scene(taker.scene)
        return _Taken(taker, b64encode(data).decode(), hashlib.sha256(data).hexdigest())


ITS_OWN_PAGE = "a competition shows itself to its own page alone: start it with --view, or in development mode (-d)"
"""Why others are told nothing."""


def offer_viewer_services(server: Server, served: Served, tell: Tell, control: Control) -> None:
    """Answer those who look on. Nothing is made or kept before somebody asks.

    In a competition that is the server's own page, which has its key: the pose of every part, and time that stands
    when one likes, are nothing that a program of the original was given.

    Args:
        server: where to answer.
        served: a cell, a robot's node, or a recording.
        tell: tells what its panel shows.
        control: lets them say how its time passes.
    """
    SceneServices(served).offer(server)
    offer_panel(server, tell, control)
    if served.in_competition:
        server.guard(FOR_ONLOOKERS, ITS_OWN_PAGE)
