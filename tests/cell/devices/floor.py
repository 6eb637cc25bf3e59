"""Running cell with short helpers for the tests of devices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.cell.model.build import WorldPart
from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.arm import ARM_JOINTS, ServoProfile
from cellwright.config.trial.trial import Part, Trial
from cellwright.engine.clock import nanoseconds
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.util.pose import Pose
from tests.support.places import BIN_SURFACE

MM = 1e-3
MILLISECOND = 1_000_000
OVER_BINS = (0.25, 3.2, -0.47, 2.09, 3.1, -1.51, 0.0)
"""Arm posture with the cup over bin 7."""
CUP_FACE = 0.005
"""Distance from the gripper link to the face of the cup [m]."""

# the scripted lesson's waypoints, in its own order: elbow, rail, shoulder lift, shoulder pan, wrist 1, 2, 3
LESSON_ORDER = (1, 3, 2, 0, 4, 5, 6)


def in_order(lesson_waypoint: Sequence[float]) -> list[float]:
    """Return a waypoint of the lesson in the controller's order."""
    return [lesson_waypoint[k] for k in LESSON_ORDER]


class Floor:
    """Cell with helpers that move things by hand."""

    def __init__(self, trial: Trial, servo: ServoProfile | None = None) -> None:
        self.cell = Cell(trial, servo=servo, competition=False)
        self.simulation = self.cell.simulation
        self.model: Any = self.simulation.model
        self._scratch: Any = mujoco.MjData(self.model)

    @property
    def now(self) -> float:
        """Simulation time [s]."""
        return self.simulation.time

    def reset(self) -> Floor:
        self.cell.reset()
        return self

    def run(self, seconds: float) -> None:
        self.simulation.step_until(self.simulation.now + nanoseconds(seconds))

    def run_until(self, condition: Callable[[], bool], limit: float) -> float:
        """Step until a condition holds; return the time that took [s]."""
        start = self.simulation.now
        end = start + nanoseconds(limit)
        while not condition():
            if self.simulation.now >= end:
                raise AssertionError(f"it did not happen within {limit} s")
            self.cell.step()
        return (self.simulation.now - start) / 1e9

    @property
    def arm(self) -> Arm:
        assert self.cell.arm is not None
        return self.cell.arm

    @property
    def gripper(self) -> VacuumGripper:
        assert isinstance(self.cell.gripper, VacuumGripper)
        return self.cell.gripper

    def part(self, name: str) -> WorldPart:
        return self.cell.parts.part(name)

    def pose(self, name: str) -> Pose:
        return self.cell.parts.pose(self.part(name))

    def velocity(self, name: str) -> NDArray[np.float64]:
        dof = self.part(name).dof
        return np.array(self.simulation.data.qvel[dof : dof + 6])

    def place(self, name: str, pose: Pose) -> None:
        self.cell.parts.place(self.part(name), pose)

    def lay(self, name: str, x: float, y: float, surface: float, yaw: float = 0.0, above: float = 1e-4) -> None:
        """Place a part upright, `above` [m] over a surface at height `surface` [m]."""
        part = self.part(name)
        z = surface - part_type(part.type).bottom + above
        self.place(name, Pose.from_rpy((x, y, z), (0.0, 0.0, yaw)))

    def asleep(self, body: int) -> bool:
        return bool(self.simulation.data.tree_asleep[self.model.body_treeid[body]] >= 0)

    def body_pose(self, name: str) -> Pose:
        self.simulation.refresh()
        body = self.simulation.data.body(name)
        x, y, z = (float(value) for value in body.xpos)
        qw, qx, qy, qz = (float(value) for value in body.xquat)
        return Pose((x, y, z), (qw, qx, qy, qz))

    def cup(self) -> Pose:
        """world_T_gripper link."""
        return self.body_pose("vacuum_gripper_link")

    def put_arm(self, positions: Sequence[float]) -> None:
        """Move the arm to these positions at once, at rest, and hold it there."""
        data = self.simulation.data
        for name, value in zip(ARM_JOINTS, positions, strict=True):
            data.joint(name).qpos[0] = value
            data.joint(name).qvel[0] = 0.0
        self.simulation.touch()
        self.arm.controller.start(list(positions), self.simulation.now)
        self.arm.set_stepping(True)

    def reach(self, world_T_gripper: Pose) -> list[float]:
        """Return joint positions for a pose of the gripper link, by damped least squares from the present posture."""
        data, model = self._scratch, self.model
        data.qpos[:] = self.simulation.data.qpos
        joints = [model.joint(name) for name in ARM_JOINTS]
        addresses = [int(joint.qposadr[0]) for joint in joints]
        dofs = [int(joint.dofadr[0]) for joint in joints]
        body = model.body("vacuum_gripper_link").id
        jacobian = np.zeros((6, model.nv))
        for _ in range(300):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            x, y, z = data.xpos[body].tolist()
            qw, qx, qy, qz = data.xquat[body].tolist()
            error = np.array([*np.subtract(world_T_gripper.position, (x, y, z)), 0.0, 0.0, 0.0])
            turn = (
                Pose((0, 0, 0), world_T_gripper.quaternion) @ Pose((0, 0, 0), (qw, qx, qy, qz)).inverse()
            ).quaternion
            error[3:] = 2.0 * np.array(turn[1:]) * (1.0 if turn[0] >= 0.0 else -1.0)
            if np.abs(error).max() < 1e-9:
                return [float(data.qpos[address]) for address in addresses]
            mujoco.mj_jacBody(model, data, jacobian[:3], jacobian[3:], body)
            own = jacobian[:, dofs]
            data.qpos[addresses] += own.T @ np.linalg.solve(own @ own.T + 1e-6 * np.eye(6), error)
        raise AssertionError(f"the arm does not reach {world_T_gripper}")

    def send(self, *waypoints: Sequence[float], seconds: float = 1.0) -> None:
        """Command the arm through waypoints (controller order), `seconds` each."""
        points = [
            TrajectoryPoint(list(waypoint), time_from_start_ns=nanoseconds(seconds * (k + 1)))
            for k, waypoint in enumerate(waypoints)
        ]
        self.arm.command(JointTrajectory(ARM_JOINTS, points))

    def swing(self, waypoint: Sequence[float], seconds: float) -> None:
        """Command the arm to a posture, at rest, with no jump in acceleration."""
        still = [0.0] * len(ARM_JOINTS)
        point = TrajectoryPoint(list(waypoint), still, still, nanoseconds(seconds))
        self.arm.command(JointTrajectory(ARM_JOINTS, [point]))

    def set_cup(self, world_T_gripper: Pose) -> None:
        """Move the cup to a pose at once, with the arm over the bins."""
        self.put_arm(OVER_BINS)
        self.put_arm(self.reach(world_T_gripper))

    def grasp(self, kind: str, x: float = -0.3, y: float = 0.23, surface: float = BIN_SURFACE) -> str:
        """Grip the middle of the part of a type, which lies on a bin; return the part's name."""
        name = named(kind)
        self.lay(name, x, y, surface)
        self.set_cup(down(x, y, surface + part_type(kind).top - part_type(kind).bottom - 0.5 * MM))
        self.gripper.set_enabled(True)
        self.run_until(lambda: self.gripper.attached, 0.25)
        return name


def down(x: float, y: float, z: float, tilt: float = 0.0) -> Pose:
    """Return world_T_gripper with the face of the cup at a height [m], facing down, tilted about x [rad]."""
    turned = Pose.from_rpy((0.0, 0.0, 0.0), (tilt, 0.0, 0.0))
    lifted = turned.rotate((0.0, 0.0, CUP_FACE))
    return Pose((x + lifted[0], y + lifted[1], z + lifted[2]), turned.quaternion)


def one_of_each(*, has_arm: bool = True, **more: Any) -> Trial:
    """Return a cell with one part of each type, named by `named`, side by side on the floor beyond the arm's reach."""
    parts = tuple(
        Part(named(kind), kind, Pose((-4.0 + 0.5 * k, -3.0, 0.0001 - part_type(kind).bottom)))
        for k, kind in enumerate(PART_TYPES)
    )
    return Trial("floor", has_arm=has_arm, bin_parts=parts, time_limit=None, **more)


def named(kind: str) -> str:
    """Return the name of the part of a type in the cell `one_of_each`."""
    return f"floor|{kind}_1"
