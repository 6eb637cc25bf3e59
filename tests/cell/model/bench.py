"""Test bench for a cell: a world, its state, and short helpers for the physics tests."""

from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.model.build import World, WorldPart, build_world
from cellwright.cell.model.parts import part_type
from cellwright.config.trial.trial import CellSettings, Part, Trial
from cellwright.util.pose import Pose, Quaternion, Vector3

MM = 1e-3
BELT = "conveyor_belt"


class Bench:
    """World and one state of it, in its first pose."""

    def __init__(self, trial: Trial, *, sleep: bool = True) -> None:
        self.world: World = build_world(trial)
        self.model: Any = self.world.model
        if not sleep:
            self.model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        self.data: Any = mujoco.MjData(self.model)
        self.world.set_initial_posture(self.data)
        self.parts = {part.name: part for part in (*self.world.parts, *self.world.bodies)}

    def run(self, seconds: float) -> None:
        mujoco.mj_step(self.model, self.data, round(seconds / self.model.opt.timestep))

    def part(self, name: str) -> WorldPart:
        return self.parts[name]

    def position(self, part: WorldPart) -> NDArray[np.float64]:
        return np.array(self.data.qpos[part.qpos : part.qpos + 3])

    def pose(self, part: WorldPart) -> NDArray[np.float64]:
        return np.array(self.data.qpos[part.qpos : part.qpos + 7])

    def place(self, part: WorldPart, position: Sequence[float], quaternion: Sequence[float] = (1, 0, 0, 0)) -> None:
        self.data.qpos[part.qpos : part.qpos + 7] = (*position, *quaternion)
        self.data.qvel[part.dof : part.dof + 6] = 0.0

    def velocity(self, part: WorldPart) -> NDArray[np.float64]:
        return np.array(self.data.qvel[part.dof : part.dof + 6])

    def asleep(self, part: WorldPart) -> bool:
        return bool(self.data.tree_asleep[self.tree(part)] >= 0)

    def tree(self, part: WorldPart) -> int:
        return int(self.model.body_treeid[part.body])

    def wake(self, part: WorldPart) -> None:
        self.data.qvel[part.dof : part.dof + 6] = -0.0

    def set_belt(self, speed: float) -> None:
        self.model.geom_surfacevel[self.model.geom(BELT).id][0] = speed

    def command(self, actuator: str, position: float, velocity: float = 0.0) -> None:
        address = self.model.actuator_ctrladr[self.model.actuator(actuator).id]
        self.data.ctrl[address : address + 2] = position, velocity

    def put_arm(self, joints: dict[str, float]) -> None:
        """Move the arm to these joint values at once, and hold it there."""
        for name, value in joints.items():
            self.data.qpos[self.model.joint(name).qposadr[0]] = value
            self.command(name, value)

    def body_pose(self, name: str) -> Pose:
        mujoco.mj_kinematics(self.model, self.data)
        body = self.data.body(name)
        return Pose(vector(body.xpos), quaternion(body.xquat))

    def hold(self, part: WorldPart, weld: int, holder: str) -> None:
        """Weld a part to a body in their present poses, as a gripper or a lock does."""
        mujoco.mj_kinematics(self.model, self.data)
        world_T_holder, world_T_part = self.body_pose(holder), self.body_pose(part.name)
        relative = world_T_holder.inverse() @ world_T_part
        self.model.eq_data[weld][3:6] = relative.position
        self.model.eq_data[weld][6:10] = relative.quaternion
        self.data.eq_active[weld] = 1

    def relative(self, part: WorldPart, holder: str) -> Pose:
        """Return the pose of the part in the frame of a body."""
        return self.body_pose(holder).inverse() @ self.body_pose(part.name)


def vector(values: Iterable[float]) -> Vector3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def quaternion(values: Iterable[float]) -> Quaternion:
    w, x, y, z = (float(value) for value in values)
    return (w, x, y, z)


def part_on(kind: str, x: float, y: float, surface: float, *, name: str = "", above: float = 1e-4) -> Part:
    """Return an upright part of a type, `above` [m] over a surface at height `surface` [m]."""
    pose = Pose((x, y, surface - part_type(kind).bottom + above))
    return Part(name or f"bench|{kind}_1", kind, pose)


def cell(*parts: Part, **more: Any) -> Trial:
    return Trial("bench", bin_parts=parts, **more)


def at_step(numerator: int, denominator: int) -> CellSettings:
    return CellSettings(timestep=(numerator, denominator))


def distance(a: Pose, b: Pose) -> float:
    return float(np.linalg.norm(np.subtract(a.position, b.position)))
