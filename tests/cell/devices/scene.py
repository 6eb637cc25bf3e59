"""Small scenes for tests of sensors: solid blocks, visual housings, parts and an AGV, without gravity."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mujoco

from cellwright.cell.devices.scene import ModelSnapshot, SceneModel, collision_geoms
from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import IDENTITY_QUATERNION, Pose, Quaternion, Vector3
from tests.support.places import AGVS

BOX = mujoco.mjtGeom.mjGEOM_BOX
CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER

DRAWN_ONLY = 2
SOLID_ONLY = 3


def empty_spec() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.option.gravity = [0.0, 0.0, 0.0]
    return spec


def add_block(spec: mujoco.MjSpec, centre: Vector3, half: Vector3, *, group: int = SOLID_ONLY) -> None:
    """Add a static box; it does not collide when it is only drawn."""
    touches = 0 if group == DRAWN_ONLY else 1
    spec.worldbody.add_geom(type=BOX, pos=centre, size=half, group=group, contype=touches, conaffinity=touches)


def add_part(
    spec: mujoco.MjSpec,
    name: str,
    pose: Pose,
    half: Vector3 = (0.05, 0.05, 0.05),
    shape: Any = BOX,
    centre: Vector3 = (0.0, 0.0, 0.0),
) -> None:
    """Add a free body with one collision shape and a larger visual shape around it."""
    body = spec.worldbody.add_body(name=name, pos=pose.position, quat=pose.quaternion)
    body.add_freejoint(name=name)
    body.add_geom(type=shape, size=half, pos=centre, group=SOLID_ONLY, mass=0.5)
    body.add_geom(type=BOX, size=[4 * max(half)] * 3, group=DRAWN_ONLY, contype=0, conaffinity=0, mass=0)


def add_agv(spec: mujoco.MjSpec, number: int, position: Vector3, quaternion: Quaternion = IDENTITY_QUATERNION) -> None:
    """Add an AGV with a column and, on a body of its own, a tray."""
    agv = spec.worldbody.add_body(name=f"agv{number}", pos=position, quat=quaternion)
    agv.add_geom(type=BOX, size=[0.28, 0.51, 0.2], pos=[0, 0, 0.3], group=SOLID_ONLY)
    agv.add_geom(type=CYLINDER, size=[0.087, 0.4375, 0], pos=[0, -0.275, 0.4375], group=SOLID_ONLY)
    tray = agv.add_body(name=f"agv{number}::kit_tray_{number}::kit_tray_{number}::tray", pos=[0, 0.15, 0.75])
    tray.add_geom(name=f"kit_tray_{number}_plate", type=BOX, size=[0.25, 0.35, 0.005], group=SOLID_ONLY)


def make_simulation(
    spec: mujoco.MjSpec, *devices: Device, timestep: Fraction = Fraction(1, 500), seed: int = 0
) -> Simulation:
    """Return a simulation at the beginning of its run."""
    simulation = Simulation(spec.compile(), timestep=timestep, seed=seed)
    for device in devices:
        simulation.add(device)
    simulation.reset()
    return simulation


def scene_of(simulation: Simulation, *models: tuple[str, str]) -> ModelSnapshot:
    """Return a scene of (full name, type); a tray is nested in the AGV of its number."""
    model = simulation.model
    found = []
    for name, kind in models:
        number = name[-1]
        is_tray = kind == "kit_tray"
        body = model.body(f"agv{number}::{name}::{name}::tray" if is_tray else name).id
        carrier = AGVS[int(number)] if kind.startswith("agv") else None
        nested_in = f"agv{number}" if is_tray else None
        found.append(SceneModel(name, kind, body, collision_geoms(model, body), nested_in, carrier))
    return ModelSnapshot(simulation, found)


def move(simulation: Simulation, name: str, pose: Pose) -> None:
    """Move a part elsewhere, by hand."""
    address = int(simulation.model.joint(name).qposadr[0])
    simulation.data.qpos[address : address + 7] = [*pose.position, *pose.quaternion]
    simulation.touch()


def push(simulation: Simulation, name: str, velocity: Vector3) -> None:
    """Let a part glide with a velocity [m/s]."""
    address = int(simulation.model.joint(name).dofadr[0])
    simulation.data.qvel[address : address + 3] = velocity
