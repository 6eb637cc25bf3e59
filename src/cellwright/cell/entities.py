"""Entities of a cell for programs that inspect or arrange it: the robot, AGVs, trays, furniture and parts by name.

`Entities` reads and changes the cell; `viewer.services` offers it under the names of `simulation_interfaces`. Names of
parts are those that logical cameras show. All poses are in the world frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.devices.scene import collision_geoms
from cellwright.cell.interface.frames import link_frames, static_frames
from cellwright.cell.kitting.fates import Removal
from cellwright.cell.model.build import WorldPart
from cellwright.cell.model.clones import clone_name
from cellwright.cell.model.furniture import SHELF_BODY
from cellwright.cell.model.link_frames import frames_by_link
from cellwright.cell.named_poses import Box, NamedPose, named_poses
from cellwright.config.layout.arm_models import chain_in_engine
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose, Vector3, normalized

if TYPE_CHECKING:
    from cellwright.cell.cell import Cell

FARTHEST = 50.0
"""Largest coordinate [m] of a pose at which a part may be placed."""

MAX_SPEED = 20.0
"""Largest velocity [m/s, rad/s] that a part may be given along an axis."""


class Category(IntEnum):
    """Category of an entity, as numbered by `simulation_interfaces/EntityCategory`, which has no 3."""

    OBJECT = 0
    ROBOT = 1
    HUMAN = 2
    DYNAMIC_OBJECT = 4
    STATIC_OBJECT = 5


@dataclass(frozen=True)
class EntityInfo:
    """Description of an entity."""

    category: Category
    description: str
    tags: tuple[str, ...] = ()


@dataclass(frozen=True)
class EntityState:
    """Pose of an entity, its velocity [m/s, rad/s] and its acceleration [m/s², rad/s²], in the world frame."""

    pose: Pose
    linear: Vector3 = (0.0, 0.0, 0.0)
    angular: Vector3 = (0.0, 0.0, 0.0)
    linear_acceleration: Vector3 = (0.0, 0.0, 0.0)
    angular_acceleration: Vector3 = (0.0, 0.0, 0.0)


@dataclass
class Entities:
    """Entities of a cell.

    Example:
        >>> from cellwright import Cell, load_trial
        >>> entities = Entities(Cell(load_trial("lesson"), competition=False))
        >>> entities.info("bin8|gear_part_1").tags
        ('gear_part',)
        >>> [round(x, 3) for x in entities.state("agv1").pose.position]
        [0.3, 3.3, 0.0]

    Args:
        cell: the cell.
    """

    cell: Cell
    _infos: dict[str, EntityInfo] = field(default_factory=dict)
    _spawned: dict[str, tuple[str, Pose]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.cell.simulation.followers.append(self)

    def remember(self) -> object:
        """Return what is known of spawned parts and of entities with another description, for a snapshot."""
        return dict(self._infos), dict(self._spawned)

    def forget(self) -> None:
        """Forget both: the run starts again."""
        self._infos.clear()
        self._spawned.clear()

    def recall(self, memory: Any) -> None:
        """Know again what `remember` returned."""
        infos, spawned = memory
        self._infos.update(infos)
        self._spawned.update(spawned)

    @property
    def spawned(self) -> dict[str, tuple[str, Pose]]:
        """Types of the spawned parts that are in play, and the poses at which they appeared, by name."""
        return {name: given for name, given in self._spawned.items() if name in self.cell.parts.in_play}

    def names(self) -> list[str]:
        """Return the names of all entities: robot, AGVs, trays and furniture, then the parts in play."""
        parts = self.cell.parts
        return [*self._fixed(), *(part.name for part in parts.all if part.name in parts.in_play)]

    def info(self, name: str) -> EntityInfo:
        """Return the description of an entity.

        Raises:
            UnknownNameError: there is none of this name.
        """
        body = self._body(name)
        if name in self._infos:
            return self._infos[name]
        if name in self.cell.parts.by_name:
            kind = self.cell.parts.part(name).type
            return EntityInfo(Category.OBJECT, f"part of type {kind}", (kind,))
        if (arm := next((each for each in self.cell.trial.arms if each.name == name), None)) is not None:
            what = "UR10 on a rail" if arm.is_original else f"arm {arm.model}"
            holds = "" if arm.tool.kind == "none" else f", with a {arm.tool.kind} gripper"
            return EntityInfo(Category.ROBOT, what + holds)
        if (robot := next((each for each in self.cell.trial.layout.robots if each.name == name), None)) is not None:
            return EntityInfo(Category.ROBOT, f"robot {robot.model}, on topics of /{robot.namespace}")
        if name in {each.name for each in self.cell.trial.carriers}:
            return EntityInfo(Category.ROBOT, "AGV that takes a tray away")
        if name in {each.tray_link for each in self.cell.trial.layout.trays}:
            return EntityInfo(Category.STATIC_OBJECT, "fixed tray", ("tray",))
        if self._is_tray(body):
            return EntityInfo(Category.DYNAMIC_OBJECT, "tray on an AGV", ("tray",))
        tags = ("bin",) if name in {each.name for each in self.cell.trial.layout.bins} else ()
        return EntityInfo(Category.STATIC_OBJECT, "bin" if tags else "furniture", tags)

    def set_info(self, name: str, info: EntityInfo) -> None:
        """Replace the description of an entity; it lasts until the run starts again.

        Raises:
            UnknownNameError: there is none of this name.
        """
        self._body(name)
        self._infos[name] = info

    def state(self, name: str) -> EntityState:
        """Return pose and velocity of an entity, and its acceleration in the last step.

        Raises:
            UnknownNameError: there is none of this name.
        """
        body = self._body(name)
        simulation = self.cell.simulation
        model, data = simulation.model, simulation.data
        simulation.refresh()
        position, quaternion = data.xpos[body].tolist(), data.xquat[body].tolist()
        pose = Pose(tuple(position), tuple(quaternion))
        # a free joint's velocity: linear in the world, angular in the body
        if name in self.cell.parts.by_name:
            dof = self.cell.parts.part(name).dof
            (linear, turn), (push, twist) = (
                each[dof : dof + 6].reshape(2, 3).tolist() for each in (data.qvel, data.qacc)
            )
            # the engine no longer computes its acceleration
            if data.tree_asleep[model.body_treeid[body]] >= 0:
                return EntityState(pose)
            return EntityState(pose, tuple(linear), pose.rotate(tuple(turn)), tuple(push), pose.rotate(tuple(twist)))
        if model.body_weldid[body] == 0:
            return EntityState(pose)
        velocity, acceleration = np.zeros(6), np.zeros(6)
        mujoco.mj_comVel(model, data)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
        mujoco.mj_rnePostConstraint(model, data)
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, acceleration, 0)
        # the engine's acceleration is that of an accelerometer
        acceleration[3:] += model.opt.gravity
        parts = (velocity[3:], velocity[:3], acceleration[3:], acceleration[:3])
        return EntityState(pose, *(tuple(each.tolist()) for each in parts))

    def set_state(self, name: str, pose: Pose | None, velocity: tuple[Vector3, Vector3] | None) -> None:
        """Place a part, and set its velocity: linear and angular, in the world frame. None leaves what there is.

        A part that is held or locked is free afterwards. A part that is placed without a velocity is at rest.

        Raises:
            UnknownNameError: there is no entity of this name.
            RejectedCommandError: it is no part, or pose or velocity are out of range.
        """
        self._body(name)
        part = self._part(name)
        before = self.state(name)
        rest: Vector3 = (0.0, 0.0, 0.0)
        placed = before.pose if pose is None else _reachable(pose)
        linear, angular = velocity or ((before.linear, before.angular) if pose is None else (rest, rest))
        if max(map(abs, (*linear, *angular))) <= MAX_SPEED:  # false for NaN too
            self.cell.parts.place(part, placed)
            data = self.cell.simulation.data
            data.qvel[part.dof : part.dof + 3] = linear
            data.qvel[part.dof + 3 : part.dof + 6] = placed.inverse().rotate(angular)
            # the acceleration of the last step was elsewhere
            data.qacc[part.dof : part.dof + 6] = 0.0
            return
        raise RejectedCommandError(f"{name}: velocity must be at most {MAX_SPEED:g} (got {linear} and {angular})")

    def bounds(self, name: str) -> Box | None:
        """Return the box around the solid shapes of an entity; None if it has none, as a sensor's stand.

        Raises:
            UnknownNameError: there is no entity of this name.
        """
        geoms = self.solids(name)
        model, data = self.cell.simulation.model, self.cell.simulation.data
        self.cell.simulation.refresh()
        if not geoms:
            return None
        corners = [corner for geom in geoms for corner in geom_box(model, data, geom)]
        lower, upper = np.min(corners, axis=0).tolist(), np.max(corners, axis=0).tolist()
        return Box(tuple(lower), tuple(upper))

    def solids(self, name: str) -> tuple[int, ...]:
        """Return the ids of the engine's colliding geoms of an entity, which may have none.

        Raises:
            UnknownNameError: there is none of this name.
        """
        return collision_geoms(self.cell.simulation.model, self._body(name))

    def named_poses(self) -> tuple[NamedPose, ...]:
        """Return the places of the cell where parts are put: bins, begin of the belt, load points and trays."""
        return named_poses(self.cell.trial)

    def frame(self, name: str) -> Pose:
        """Return the present pose of a frame: "world", an entity, a link, or a fixed frame of the cell.

        Raises:
            UnknownNameError: there is none of this name.
        """
        entities, links = self.names(), self._links()
        on_links = (each for arm in self.cell.trial.arms for each in link_frames(arm))
        fixed = {each.child: each for each in (*static_frames(self.cell.trial), *on_links)}
        if name == "world":
            return Pose((0.0, 0.0, 0.0))
        if name in entities:
            return self.state(name).pose
        if name in links:
            self.cell.simulation.refresh()
            data, body = self.cell.simulation.data, links[name]
            return Pose(tuple(data.xpos[body].tolist()), tuple(data.xquat[body].tolist()))
        if name in fixed:
            return self.frame(fixed[name].parent) @ fixed[name].pose
        raise UnknownNameError("frame", name, ["world", *fixed, *links, *entities])

    @property
    def types(self) -> frozenset[str]:
        """Types of all parts, in play or not."""
        return frozenset(
            {*(part.type for part in self.cell.parts.world.parts), *dict(self.cell.trial.belt_clones()).values()}
        )

    def spawnable(self) -> Mapping[str, int]:
        """Return the number of parts of each type that wait and can be spawned."""
        found: dict[str, int] = {}
        for kind, _ in self._waiting():
            found[kind] = found.get(kind, 0) + 1
        return dict(sorted(found.items()))

    def spawn(self, kind: str, name: str, pose: Pose) -> str:
        """Put a waiting part of a type into play, at rest; return its name.

        Args:
            kind: part type.
            name: name of a waiting part of this type; empty takes the last one that the belt would bring.
            pose: its pose in the world frame.

        Raises:
            UnknownNameError: no waiting part has this name, or none is of this type.
            RejectedCommandError: the pose is not finite or too far away.
        """
        waiting = list(self._waiting())
        of_kind = [each for type_, each in waiting if type_ == kind]
        if not of_kind:
            raise UnknownNameError("waiting part type", kind, sorted({type_ for type_, _ in waiting}))
        chosen = name or of_kind[-1]
        if chosen not in of_kind:
            raise UnknownNameError(f"waiting part of type {kind}", name, of_kind)
        placed = _reachable(pose)
        self.cell.parts.appear(chosen, placed)
        dof = self.cell.parts.part(chosen).dof
        self.cell.simulation.data.qacc[dof : dof + 6] = 0.0
        self._spawned[chosen] = kind, placed
        return chosen

    def delete(self, name: str) -> None:
        """Take a part out of the cell.

        Raises:
            UnknownNameError: there is no entity of this name.
            RejectedCommandError: it is no part.
        """
        self._body(name)
        self.cell.parts.put_away(self._part(name), Removal.CLEARING)
        self._spawned.pop(name, None)
        self._infos.pop(name, None)

    def _waiting(self) -> Iterator[tuple[str, str]]:
        """Yield type and name of each part that is not in play and that the belt has not brought yet."""
        parts, populations = self.cell.parts, self.cell.populations.values()
        for part in parts.world.parts:
            # the demo tray's come by themselves
            if part.name not in parts.in_play and not part.pooled:
                yield part.type, part.name
        for short, kind in self.cell.trial.belt_clones():
            name = clone_name(short)
            is_ahead = any(each.is_ahead(kind, int(short.rpartition("_")[2])) for each in populations)
            if name not in parts.in_play and (is_ahead or name in self._spawned):
                yield kind, name

    def _part(self, name: str) -> WorldPart:
        if name not in self.cell.parts.by_name:
            raise RejectedCommandError(f"{name}: is no part; only parts can be placed or deleted")
        return self.cell.parts.part(name)

    def _fixed(self) -> dict[str, int]:
        """Return the engine's bodies of the entities that are no parts, by name."""
        model = self.cell.simulation.first_model
        parts = {part.body for part in (*self.cell.parts.world.parts, *self.cell.parts.world.bodies)}
        found, trial = {}, self.cell.trial
        owners = {chain_in_engine(each, trial.arm_models).root: each.name for each in trial.arms}
        owners |= {robot.base: robot.name for robot in trial.layout.robots}
        for body in range(1, model.nbody):
            name = model.body(body).name
            stands = model.body_parentid[body] == 0 and body not in parts and name != SHELF_BODY
            if stands or name in owners or self._is_tray(body):
                found[owners.get(name, name)] = body
        return found

    def _links(self) -> dict[str, int]:
        """Return the engine's bodies of the links that other links or joints carry, by the names of their frames."""
        model, frames = self.cell.simulation.first_model, frames_by_link(self.cell.trial)
        names = {body: model.body(body).name for body in range(1, model.nbody) if model.body_parentid[body]}
        return {frames.get(name, name): body for body, name in names.items()}

    def _is_tray(self, body: int) -> bool:
        return any(self.cell.simulation.model.body(tray.link).id == body for tray in self.cell.trays.values())

    def _body(self, name: str) -> int:
        parts = self.cell.parts
        if name in parts.in_play:
            return parts.part(name).body
        fixed = self._fixed()
        if name not in fixed:
            raise UnknownNameError("entity", name, self.names())
        return fixed[name]


def _reachable(pose: Pose) -> Pose:
    """Return a pose with a quaternion of length 1.

    Raises:
        RejectedCommandError: it is not finite, too far away, or its quaternion has another length.
    """
    length = math.hypot(*pose.quaternion)
    if not pose.is_finite() or max(map(abs, pose.position)) > FARTHEST or abs(length - 1.0) > 1e-3:
        raise RejectedCommandError(
            f"pose must be within {FARTHEST:g} m, its quaternion of length 1 (got {pose.position}, {pose.quaternion})"
        )
    return Pose(pose.position, normalized(pose.quaternion))


def geom_box(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return lower and upper corner [m] of the box around a geom along the world's axes."""
    centre, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
    turn = data.geom_xmat[geom].reshape(3, 3)
    middle, reach = data.geom_xpos[geom] + turn @ centre, np.abs(turn) @ half
    return middle - reach, middle + reach
