"""MJCF reader: a robot as the tree of its joints, as from a URDF, and what a URDF has no word for.

The engine's own parser reads the file, so defaults, angles, frames and included files are what they are there. A link
has the name of its body, and its frame is the body's, unless a joint's `pos` is not 0: then it lies in that joint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cellwright.config.parsing.tree import Problem, Problems
from cellwright.config.robot.mjcf_drives import (
    Actuation,
    JointDynamics,
    PositionDrive,
    read_actuation,
    read_dynamics,
    read_mimics,
)
from cellwright.config.robot.mjcf_file import CompiledMjcf, compile_mjcf
from cellwright.config.robot.mjcf_shapes import ShapeReader, pose_at
from cellwright.config.robot.model import (
    Inertial,
    Joint,
    JointType,
    Limits,
    Link,
    Mimic,
    RobotModel,
    in_index_order,
    parent_T_child,
)
from cellwright.config.robot.urdf import abbreviated, report_warnings
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose, Vector3

HOME = "home"
"""Name of the keyframe with the home position."""
_WORLD = "world"


@dataclass(frozen=True)
class MjcfRobot:
    """Robot of an MJCF file.

    Attributes:
        model: links and joints. Sites with a name are links without a mass, on fixed joints.
        world_T_root: pose of the root link in the file's world [m].
        drives: gains of the position actuators, by joint; empty if the file has none.
        dynamics: armature, damping and dry friction of the driven joints that have any, by joint.
        sites: the links that are sites.
        home: keyframe `home` [rad; m], by joint; empty if the file has none.
    """

    model: RobotModel
    world_T_root: Pose
    drives: Mapping[str, PositionDrive]
    dynamics: Mapping[str, JointDynamics]
    sites: tuple[str, ...]
    home: Mapping[str, float]


def read_mjcf(path: Path, *, warn: Callable[[str], None]) -> MjcfRobot:
    """Return the robot in an MJCF file; `warn` gets a line `path:line: element: what` for each thing left out.

    Positions of joints are the engine's (`qpos`), also where a joint has a `ref`. MJCF has no velocity limits, so
    joints have none.

    Raises:
        DescriptionError: the file is no readable robot, or has what a tree of joints cannot hold.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> arm = '<body name="arm"><joint name="turn" axis="0 0 1"/><geom size="0.1"/><site name="tip"/></body>'
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder) / "arm.xml"
        ...     _ = path.write_text(f'<mujoco><worldbody><body name="base">{arm}</body></worldbody></mujoco>')
        ...     robot = read_mjcf(path, warn=lambda line: None)
        >>> [joint.child for joint in robot.model.joints], robot.sites
        (['arm', 'tip'], ('tip',))
    """
    problems = Problems()
    robot = _RobotReader(compile_mjcf(path), problems).read()
    if problems.errors:
        raise DescriptionError(problems.errors, problems.warnings)
    report_warnings(problems, path, warn)
    return robot


class _RobotReader:
    def __init__(self, mjcf: CompiledMjcf, problems: Problems) -> None:
        self._mjcf, self._problems = mjcf, problems
        self._model = mjcf.model
        self._shapes = ShapeReader(mjcf, problems)
        self._link_names, self._joint_names = _Names(), _Names()
        self._links: dict[str, Link] = {}
        self._joints: list[Joint] = []
        self._names_of_joints: dict[int, str] = {}
        self._sites: list[str] = []

    def read(self) -> MjcfRobot:
        """Return the robot; it is valid only if no errors were reported."""
        model = self._model
        # names of the file go before those that are made here
        self._link_names.reserve(model.body(number).name for number in range(1, model.nbody))
        self._joint_names.reserve(model.joint(number).name for number in range(model.njnt))
        root, world_T_root = self._add_bodies()
        joints = in_index_order(root, self._joints)
        names = self._names_of_joints
        mimics = read_mimics(self._mjcf, names, self._problems)
        actuation = read_actuation(self._mjcf, names, mimics, self._problems)
        joints = [_completed(joint, actuation, mimics) for joint in joints]
        written = tuple(joint.name for joint in self._joints)
        is_sorted = written == tuple(joint.name for joint in joints)
        robot = RobotModel(
            self._mjcf.name, root, self._shapes.with_seen(self._links), tuple(joints), () if is_sorted else written
        )
        self._warn_of_efforts(robot)
        dynamics = read_dynamics(self._mjcf, names, self._problems)
        return MjcfRobot(robot, world_T_root, actuation.drives, dynamics, tuple(self._sites), self._home())

    def _add_bodies(self) -> tuple[str, Pose]:
        """Add all links and joints; return the root and its pose in the file's world [m]."""
        model = self._model
        if model.nbody == 1:
            self._problems.error(self._mjcf.root, "the file has no bodies; add the robot's to <worldbody>")
            return _WORLD, Pose()
        if model.body_geomnum[0]:
            element = self._mjcf.element("geom", 0)
            self._problems.warn(element, "shapes of the world are no part of the robot, and are left out")
        outermost = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
        is_root = len(outermost) == 1 and all(kind == "free" for kind in self._kinds(outermost[0]))
        body_frames: dict[int, tuple[str, Pose]] = {}
        root, world_T_root = _WORLD, Pose()
        if not is_root:
            root = self._link_names.new(_WORLD)
            self._links[root] = Link(root)
        body_frames[0] = (root, Pose())
        for body in range(1, model.nbody):
            name = model.body(body).name or self._link_names.new(f"body_{body}")
            placed = pose_at(model.body_pos[body], model.body_quat[body])
            if is_root and body == outermost[0]:
                root, world_T_root = name, placed
                link_T_body = Pose()
                if model.body_jntnum[body]:
                    element = self._mjcf.element("joint", int(model.body_jntadr[body]))
                    self._problems.warn(
                        element, "the root is placed where the robot stands; its free joint is left out"
                    )
            else:
                parent, parent_T_body = body_frames[int(model.body_parentid[body])]
                link_T_body = self._add_joints(body, parent, parent_T_body @ placed, name)
            body_frames[body] = (name, link_T_body)
            self._links[name] = Link(name, self._inertial(body, link_T_body), self._shapes.read(body, link_T_body))
            self._add_sites(body, name, link_T_body)
        return root, world_T_root

    def _kinds(self, body: int) -> list[str]:
        first, count = int(self._model.body_jntadr[body]), int(self._model.body_jntnum[body])
        return [self._mjcf.kind("mjtJoint", self._model.jnt_type[joint]) for joint in range(first, first + count)]

    def _add_joints(self, body: int, parent: str, parent_T_body: Pose, link: str) -> Pose:
        """Add the joints between a body's parent and its link; return the body's pose in the frame of its link.

        The engine turns a body about `pos` of each joint in turn: shift to it, turn, shift back. What is between two
        turns is the origin of the second joint, so the link's frame is left at the last `pos`.
        """
        model, kinds = self._model, self._kinds(body)
        if not kinds:
            name = self._joint_names.new(f"{link}_joint")
            self._joints.append(Joint(name, JointType.FIXED, parent, link, parent_T_body, (0.0, 0.0, 0.0)))
            return Pose()
        origin, first = parent_T_body, int(model.body_jntadr[body])
        shift = Pose()
        for joint, kind in enumerate(kinds, start=first):
            name = model.joint(joint).name or self._joint_names.new(f"{link}_joint")
            self._names_of_joints[joint] = name
            is_last = joint == first + len(kinds) - 1
            child = link if is_last else self._link_names.new(f"{name}_link")
            if not is_last:
                self._links[child] = Link(child)
            if kind == "free":
                message = "a free joint below the root; give the robot one outermost body, and other bodies a file each"
                self._problems.error(self._mjcf.element("joint", joint), message)
            # a slide moves the frame wherever it is
            shift = Pose() if kind == "slide" else Pose(_vector(model.jnt_pos[joint]))
            type_, axis, limits = self._motion(joint, kind)
            reference = float(model.qpos0[model.jnt_qposadr[joint]])
            placed = Joint(name, type_, parent, child, origin @ shift, axis, limits)
            self._joints.append(replace(placed, origin=parent_T_child(placed, -reference)))
            parent, origin = child, shift.inverse()
        return origin

    def _motion(self, joint: int, kind: str) -> tuple[JointType, Vector3, Limits]:
        model = self._model
        if kind not in ("hinge", "slide"):
            return JointType.SPHERICAL, (0.0, 0.0, 0.0), Limits()
        is_limited = bool(model.jnt_limited[joint])
        lower, upper = map(float, model.jnt_range[joint])
        limits = Limits(lower, upper) if is_limited else Limits()
        turning = JointType.REVOLUTE if is_limited else JointType.CONTINUOUS
        return turning if kind == "hinge" else JointType.PRISMATIC, _vector(model.jnt_axis[joint]), limits

    def _inertial(self, body: int, link_T_body: Pose) -> Inertial | None:
        """Return the mass and the inertia along the axes of the link; None for a body without a mass."""
        model = self._model
        mass = float(model.body_mass[body])
        if not mass:
            return None
        pose = link_T_body @ pose_at(model.body_ipos[body], model.body_iquat[body])
        turn = np.array([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T
        tensor = turn @ np.diag(model.body_inertia[body]) @ turn.T
        xx, yy, zz, xy, xz, yz = (float(tensor[row]) for row in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        return Inertial(mass, Pose(pose.position), (xx, yy, zz, xy, xz, yz))

    def _add_sites(self, body: int, link: str, link_T_body: Pose) -> None:
        model = self._model
        for site in np.flatnonzero(model.site_bodyid == body).tolist():
            name = model.site(site).name
            if not name:
                continue
            frame = self._link_names.new(name, f"{name}_site")
            self._links[frame] = Link(frame)
            self._sites.append(frame)
            origin = link_T_body @ pose_at(model.site_pos[site], model.site_quat[site])
            joint = self._joint_names.new(f"{frame}_joint")
            self._joints.append(Joint(joint, JointType.FIXED, link, frame, origin, (0.0, 0.0, 0.0)))

    def _home(self) -> dict[str, float]:
        model = self._model
        key = next((number for number in range(model.nkey) if model.key(number).name == HOME), None)
        if key is None:
            return {}
        driven = [joint for joint in self._names_of_joints if self._is_driven(joint)]
        return {self._names_of_joints[joint]: float(model.key_qpos[key][model.jnt_qposadr[joint]]) for joint in driven}

    def _is_driven(self, joint: int) -> bool:
        return self._mjcf.kind("mjtJoint", self._model.jnt_type[joint]) in ("hinge", "slide")

    def _warn_of_efforts(self, robot: RobotModel) -> None:
        names = [joint.name for joint in robot.driven if joint.mimic is None and joint.limits.effort == float("inf")]
        if names:
            count = "1 joint has" if len(names) == 1 else f"{len(names)} joints have"
            message = f"{count} no force limit ({abbreviated(names)}); treated as unlimited"
            self._problems.add(Problem(self._mjcf.root.place, "", message, "warning"))


class _Names:
    """Names of one kind, without duplicates."""

    def __init__(self) -> None:
        self._used: set[str] = set()

    def reserve(self, names: Any) -> None:
        """Note names that the file gives."""
        self._used.update(name for name in names if name)

    def new(self, *wanted: str) -> str:
        """Return the first of the names that is free, else the last one with a number."""
        free = (name for name in wanted if name not in self._used)
        name = next(free, None)
        number = 2
        while name is None:
            if f"{wanted[-1]}_{number}" not in self._used:
                name = f"{wanted[-1]}_{number}"
            number += 1
        self._used.add(name)
        return name


def _completed(joint: Joint, actuation: Actuation, mimics: Mapping[str, Mimic]) -> Joint:
    """Return a joint with its largest force and the joint that it follows."""
    effort = actuation.efforts.get(joint.name, joint.limits.effort)
    return replace(joint, limits=replace(joint.limits, effort=effort), mimic=mimics.get(joint.name))


def _vector(numbers: Any) -> Vector3:
    x, y, z = map(float, numbers)
    return (x, y, z)
