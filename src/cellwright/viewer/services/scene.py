"""Scene service, frame service with sensor and contact overlays, and the offer of all services for viewers.

Both answer in JSON and bytes:

| service | request | JSON | bytes |
|---|---|---|---|
| `cellwright/scene` | | `digest`: SHA-256 of the bytes; `about`: see `scene_metadata` | `encode_scene` |
| `cellwright/frame` | see below | `sequence`, `tick`, `run`, `digest` of the scene | `Frame.encode`, whole |
| | `since`: a `sequence` | | changes since that frame, where it is one of the newest; else whole |
| | `sensors`: true | `sensors`: see `sensor_readings` | |
| | `contacts`: true | `contacts`: see `contact_forces` | |

An answer holds what was asked for, and leaves the state as it is.
"""

from __future__ import annotations

import hashlib
import math
import secrets
from collections import deque
from functools import cached_property
from typing import Any, Protocol

import mujoco
import numpy as np

from cellwright.cell.cell import Cell
from cellwright.cell.devices import range_sensors
from cellwright.cell.devices.logical_camera import CameraReading, LogicalCamera
from cellwright.cell.devices.range_sensors import BeamReading, ProfileReading, ProximityReading
from cellwright.cell.model.arm import CUP_GEOM
from cellwright.engine.sensor import Reading, Sensor
from cellwright.middleware.bus.served import Served
from cellwright.middleware.server import Server
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.rendering.scene.engine import SceneTaker
from cellwright.rendering.scene.scene import Frame, encode_scene
from cellwright.robot.model import body_of
from cellwright.robot.node import RobotNode
from cellwright.util.pose import Pose
from cellwright.viewer.services.control import Control, Tell, offer_panel
from cellwright.viewer.services.names import FOR_ONLOOKERS, FRAME, SCENE

MOST_CONTACTS = 300
"""So many contacts are told, the strongest first."""

HISTORY_LENGTH = 8
"""Frames that are kept for `since`: enough for several pages, each with one request at a time."""

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


class SceneSource(Protocol):
    """Something to be seen: a simulation, or a recording of one."""

    @property
    def scene(self) -> bytes:
        """The scene, encoded. It stays the same."""
        ...

    def metadata(self) -> dict[str, Any]:
        """What else is known of the scene; see `scene_metadata`."""
        ...

    def frame(self) -> Frame:
        """Where the bodies are now."""
        ...

    def details(self, asked: dict[str, Any]) -> dict[str, Any]:
        """`tick`, `run`, and the overlays that a request asks for, of the moment of the newest frame."""
        ...


class ServedScene:
    """Scene of a cell or of a robot's node.

    Args:
        served: the cell or the node.
    """

    def __init__(self, served: Served) -> None:
        self._served = served

    @cached_property
    def scene(self) -> bytes:
        """The scene, encoded."""
        return encode_scene(self._taker.scene)

    def metadata(self) -> dict[str, Any]:
        """What else is known of the scene."""
        return scene_metadata(self._served, self._taker)

    def frame(self) -> Frame:
        """Where the bodies are now."""
        simulation = self._served.simulation
        simulation.refresh()
        return self._taker.frame(simulation.data, simulation.now)

    def details(self, asked: dict[str, Any]) -> dict[str, Any]:
        """`tick`, `run`, and the overlays that a request asks for."""
        simulation = self._served.simulation
        found: dict[str, Any] = {"tick": simulation.clock.tick, "run": simulation.runs}
        if asked.get("contacts") is True:
            found["contacts"] = contact_forces(self._served)
        if asked.get("sensors") is True:
            found["sensors"] = sensor_readings(self._served)
        return found

    @cached_property
    def _taker(self) -> SceneTaker:
        """Made for the first request: most simulations are never looked at."""
        return SceneTaker(self._served.simulation.model, name=self._served.name, hidden=self._served.out_of_sight)


class SceneServices:
    """Answers what there is to be seen, and where it is.

    The newest frames are kept for all pages together, each with a sequence number: a page that names the frame it has
    gets what changed since. Numbers begin anywhere, so that those of another server are unknown here.

    Args:
        source: what there is to be seen.
    """

    def __init__(self, source: SceneSource) -> None:
        self._source = source
        self._history: deque[tuple[int, Frame]] = deque(maxlen=HISTORY_LENGTH)
        self._sequence = secrets.randbits(31)

    def offer(self, server: Server) -> None:
        """Answer on a server."""
        server.offer(SCENE, self.scene)
        server.offer(FRAME, self.frame)

    def scene(self, _asked: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """What there is to be seen."""
        return {"digest": self._digest, "about": self._source.metadata()}, self._source.scene

    def frame(self, asked: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Where it is now."""
        frame = self._source.frame()
        if not self._history or not frame.equals(self._history[-1][1]):
            self._sequence += 1
            self._history.append((self._sequence, frame))
        since = asked.get("since")
        before = next((kept for sequence, kept in self._history if sequence == since), None)
        said = {"sequence": self._sequence, "digest": self._digest, **self._source.details(asked)}
        return said, frame.encode(before)

    @cached_property
    def _digest(self) -> str:
        return hashlib.sha256(self._source.scene).hexdigest()


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
    SceneServices(ServedScene(served)).offer(server)
    offer_panel(server, tell, control)
    if served.in_competition:
        server.guard(FOR_ONLOOKERS, ITS_OWN_PAGE)
