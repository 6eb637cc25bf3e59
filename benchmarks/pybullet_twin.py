"""Twin of a cell in PyBullet: the same arm, parts, furniture and belt, with the same motion.

The arm is read from the cell's own robot description. PyBullet gets it without the frames that only have a name: its
fixed joints would cost it time. Parts, furniture and AGVs are made of the shapes, masses and inertias of our
own model; the AGVs stand still and are fixed. Gravity, friction and the belt's speed are ours; all else is PyBullet's
default.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import mujoco

from benchmarks.benchmarks import BenchmarkSkippedError
from benchmarks.busy_cell import ON_BELT
from benchmarks.silence import without_output
from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import robot_description
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.ur10 import GRIPPER, UR10
from cellwright.util.pose import Pose, Quaternion

_ARM_ROOT = "linear_arm_actuator"


def pybullet_world() -> Any:
    """Return a new world of PyBullet's, without a window.

    Raises:
        BenchmarkSkippedError: PyBullet is not installed.
    """
    try:
        with without_output():
            from pybullet import DIRECT
            from pybullet_utils.bullet_client import BulletClient
    except ImportError:
        raise BenchmarkSkippedError("PyBullet is not installed (pip install --group dev)") from None
    with without_output():
        return BulletClient(DIRECT)


class PyBulletTwin:
    """A cell as PyBullet simulates it, from the present state of its parts and its arm, with the belt running.

    Args:
        cell: the original.
        sleeping: let parts at rest fall asleep, which they do not by default. Those on the belt never do: they are
            slower than PyBullet's limit for being at rest, and would stay in place.

    Raises:
        BenchmarkSkippedError: PyBullet is not installed.
    """

    def __init__(self, cell: Cell, *, sleeping: bool) -> None:
        self._bullet = pybullet_world()
        self._model, self._data = cell.simulation.model, cell.simulation.data
        self._belt_speed = cell.conveyors["belt"].speed
        self._sleeping = sleeping
        self._inertial: dict[str, Pose] = {}
        self._bullet.setTimeStep(cell.simulation.model.opt.timestep)
        self._bullet.setGravity(*self._model.opt.gravity.tolist())
        self.bodies = {part.name: self._add_part(part.name, part.body) for part in cell.world.parts}
        parts = {part.body for part in cell.world.parts}
        for body in range(self._model.nbody):
            if body not in parts and self._root(body) != _ARM_ROOT:
                self._add_fixed(body)
        self._arm = self._load_arm(cell)
        count = self._bullet.getNumJoints(self._arm)
        infos = [self._bullet.getJointInfo(self._arm, number) for number in range(count)]
        numbers = {info[1].decode(): info[0] for info in infos}
        self._joints = [numbers[name] for name in ARM_JOINTS]
        self._efforts = [joint.limits.effort for joint in UR10.driven]
        assert cell.arm is not None
        for number, position in zip(self._joints, cell.arm.read().positions, strict=True):
            self._bullet.resetJointState(self._arm, number, position)
        # bound once, because the client looks up and wraps each of its functions on every access
        self._drive, self._advance = self._bullet.setJointMotorControlArray, self._bullet.stepSimulation
        self._mode = self._bullet.POSITION_CONTROL

    def close(self) -> None:
        """Release PyBullet's world."""
        self._bullet.disconnect()

    def step(self, positions: Sequence[float], velocities: Sequence[float]) -> None:
        """Take one step, with targets for the arm's joints at its end: positions [rad; m] and velocities."""
        self._drive(
            self._arm,
            self._joints,
            self._mode,
            targetPositions=positions,
            targetVelocities=velocities,
            forces=self._efforts,
        )
        self._advance()

    def pose(self, part: str) -> Pose:
        """Return world_T_part."""
        position, quaternion = self._bullet.getBasePositionAndOrientation(self.bodies[part])
        return Pose(position, _w_first(quaternion)) @ self._inertial[part].inverse()

    def joint_positions(self) -> list[float]:
        """Return the positions of the arm's joints [rad; m]."""
        states = self._bullet.getJointStates(self._arm, self._joints)
        return [state[0] for state in states]

    def arm_masses(self) -> list[float]:
        """Return the mass [kg] that each joint of the arm moves, in their order."""
        return [self._bullet.getDynamicsInfo(self._arm, number)[0] for number in self._joints]

    def _root(self, body: int) -> str:
        name: str = self._model.body(self._model.body_rootid[body]).name
        return name

    def _touching(self, body: int) -> list[int]:
        model = self._model
        first = int(model.body_geomadr[body])
        return [geom for geom in range(first, first + int(model.body_geomnum[body])) if model.geom_contype[geom]]

    def _shape(self, geoms: Sequence[int]) -> int:
        """Return shapes of ours as one of PyBullet's, in the frame of their body."""
        bullet, model = self._bullet, self._model
        kinds = {
            mujoco.mjtGeom.mjGEOM_BOX: bullet.GEOM_BOX,
            mujoco.mjtGeom.mjGEOM_CYLINDER: bullet.GEOM_CYLINDER,
            mujoco.mjtGeom.mjGEOM_CAPSULE: bullet.GEOM_CAPSULE,
        }
        sizes = [model.geom_size[geom].tolist() for geom in geoms]
        shape: int = bullet.createCollisionShapeArray(
            shapeTypes=[kinds[mujoco.mjtGeom(model.geom_type[geom])] for geom in geoms],
            halfExtents=sizes,
            radii=[size[0] for size in sizes],
            lengths=[2 * size[1] for size in sizes],
            collisionFramePositions=[model.geom_pos[geom].tolist() for geom in geoms],
            collisionFrameOrientations=[_w_last(model.geom_quat[geom].tolist()) for geom in geoms],
        )
        return shape

    def _add_part(self, name: str, body: int) -> int:
        bullet, model = self._bullet, self._model
        inertial = Pose(model.body_ipos[body].tolist(), model.body_iquat[body].tolist())
        at = int(model.jnt_qposadr[model.body_jntadr[body]])
        place = self._data.qpos[at : at + 7].tolist()
        self._inertial[name] = inertial
        part: int = bullet.createMultiBody(
            baseMass=model.body_mass[body],
            baseCollisionShapeIndex=self._shape(self._touching(body)),
            basePosition=place[:3],
            baseOrientation=_w_last(place[3:]),
            baseInertialFramePosition=inertial.position,
            baseInertialFrameOrientation=_w_last(inertial.quaternion),
            flags=bullet.URDF_ENABLE_SLEEPING if self._sleeping else 0,
        )
        awake = name.startswith(ON_BELT) or not self._sleeping
        bullet.changeDynamics(
            part,
            -1,
            lateralFriction=self._friction(body),
            localInertiaDiagonal=model.body_inertia[body].tolist(),
            linearDamping=0.0,  # there is no air here, as there is none in our engine
            angularDamping=0.0,
            activationState=bullet.ACTIVATION_STATE_DISABLE_SLEEPING
            if awake
            else bullet.ACTIVATION_STATE_ENABLE_SLEEPING,
        )
        return part

    def _friction(self, body: int) -> float:
        """Return the friction of a body; PyBullet multiplies both sides', ours takes the larger: 1 with 1 is 1."""
        friction: float = self._model.geom_friction[self._touching(body)[0], 0]
        return friction

    def _add_fixed(self, body: int) -> None:
        """Add a fixed body: the floor, furniture, or a piece of an AGV."""
        bullet, model, data = self._bullet, self._model, self._data
        geoms = self._touching(body)
        if not geoms:
            return
        if model.geom_type[geoms[0]] == mujoco.mjtGeom.mjGEOM_PLANE:
            shape = bullet.createCollisionShape(bullet.GEOM_PLANE)
        else:
            shape = self._shape(geoms)
        fixed = bullet.createMultiBody(
            baseMass=0.0,
            baseCollisionShapeIndex=shape,
            basePosition=data.xpos[body].tolist(),
            baseOrientation=_w_last(data.xquat[body].tolist()),
        )
        bullet.changeDynamics(fixed, -1, lateralFriction=self._friction(body))
        # a body without mass stays, and its speed has effect all the same
        if model.body(body).name == gear2017().belts[0].body:
            bullet.resetBaseVelocity(fixed, (0.0, -self._belt_speed, 0.0))

    def _load_arm(self, cell: Cell) -> int:
        bullet = self._bullet
        with tempfile.TemporaryDirectory() as folder, without_output():
            path = Path(folder, "arm.urdf")
            path.write_text(arm_description(cell), encoding="utf-8")
            arm: int = bullet.loadURDF(
                str(path), useFixedBase=True, flags=bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_MERGE_FIXED_LINKS
            )
        return arm


def arm_description(cell: Cell) -> str:
    """Return the cell's robot description reduced to an engine's needs: no looks, no frames, the cup fixed."""
    robot = ElementTree.fromstring(robot_description(cell.trial))  # noqa: S314 - our own text
    for joint in robot.iter("joint"):
        if _end(joint, "child") == GRIPPER:
            joint.set("type", "fixed")
    for link in robot.iter("link"):
        for look in link.findall("visual"):
            link.remove(look)
    while idle := _idle_frames(robot):
        for element in (*robot.findall("link"), *robot.findall("joint")):
            if element.get("name") in idle or (element.tag == "joint" and _end(element, "child") in idle):
                robot.remove(element)
    return ElementTree.tostring(robot, encoding="unicode")


def _idle_frames(robot: Element) -> set[str | None]:
    """Return the links that touch nothing and carry nothing."""
    carrying = {_end(joint, "parent") for joint in robot.iter("joint")}
    return {
        link.get("name")
        for link in robot.iter("link")
        if link.get("name") not in carrying and link.find("collision") is None
    }


def _end(joint: Element, side: str) -> str:
    """Return the link at one side of a joint."""
    link = joint.find(side)
    return "" if link is None else link.get("link", "")


def _w_last(quaternion: Sequence[float]) -> tuple[float, float, float, float]:
    w, x, y, z = quaternion
    return (x, y, z, w)


def _w_first(quaternion: Sequence[float]) -> Quaternion:
    x, y, z, w = quaternion
    return (w, x, y, z)
