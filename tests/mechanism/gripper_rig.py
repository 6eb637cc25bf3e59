"""A parallel gripper on a carriage, with a part below it, in a model of its own with the cell's solver settings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.model.build import contact_time, set_solver
from cellwright.cell.model.parts import part_type
from cellwright.config.gripper import ParallelGripperSettings
from cellwright.config.gripper_links import GripperNames, palm_T_grasp
from cellwright.engine.clock import nanoseconds
from cellwright.engine.device import Device
from cellwright.engine.shapes import Role, Shape, Touch, add_shape, at, box
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.gripper_model import Contacts, add_parallel_gripper
from cellwright.mechanism.parallel_gripper import ParallelGripper
from cellwright.mechanism.welds import add_weld, grip_name
from cellwright.util.pose import Pose, Vector3

STEP = Fraction(1, 500)
NAMES = GripperNames("rig_")
PART = "part"
BANDWIDTH = 80.0
"""Bandwidth of the carriage's servo [rad/s], as that of stiff arms."""
CARRIAGE_MASS = 5.0
SPEED = 0.1
"""Speed of the carriage on its way [m/s]."""
HEIGHT = 0.5
"""Height of the carriage, from which the gripper points down [m]."""

CUBE = (box(0.04, 0.04, 0.04, at(), (0.5, 0.5, 0.5, 1.0), 1.0),)
WIDE = (box(0.16, 0.16, 0.04, at(), (0.5, 0.5, 0.5, 1.0), 1.0),)
GEAR = tuple(shape.moved(at(z=-0.006)) for shape in part_type("gear_part").solid)
GEAR_OFFSET = (0.0, 0.0, 0.0145)
"""A gear so far below the middle between the pads that they do not touch the floor."""


@dataclass(frozen=True)
class Load:
    """Part that the gripper finds: shapes, mass [kg], and the offset of its middle from that between the pads [m]."""

    shapes: tuple[Shape, ...] = CUBE
    mass: float = 1.0
    offset: Vector3 = (0.0, 0.0, 0.0)
    has_floor: bool = True


class Carriage(Device):
    """Device that drives the carriage to and fro, with the same acceleration [m/s^2] all the time, or away by `way`."""

    STATE = ("acceleration", "quarter", "start", "way")

    def __init__(self) -> None:
        super().__init__("carriage")
        self.reset()

    def reset(self) -> None:
        self.acceleration, self.quarter, self.start, self.way = 0.0, 0.1, 0, 0.0

    def before_step(self) -> None:
        simulation = self.simulation
        time = (simulation.now - self.start) / 1e9
        position, speed = self._at(time)[0], self._at(time + float(STEP))[1]
        address = int(simulation.model.actuator_ctrladr[simulation.model.actuator("carriage").id])
        simulation.data.ctrl[address : address + 2] = position, speed

    def _at(self, time: float) -> tuple[float, float]:
        if self.way:
            return (self.way, 0.0) if time > self.way / SPEED else (SPEED * time, SPEED)
        a, q = self.acceleration, self.quarter
        phase = math.fmod(time, 4 * q)
        if phase < q:
            return a * phase**2 / 2, a * phase
        if phase < 3 * q:
            rest = phase - 2 * q
            return a * q**2 - a * rest**2 / 2, -a * rest
        rest = 4 * q - phase
        return a * rest**2 / 2, -a * rest


class Rig:
    """Running rig."""

    def __init__(
        self, settings: ParallelGripperSettings, load: Load | None = None, axis: Vector3 = (1.0, 0.0, 0.0)
    ) -> None:
        self.settings, self.load = settings, load
        self.simulation = Simulation(_model(settings, load, axis), timestep=STEP, first_pose=self._open)
        self.carriage = Carriage()
        self.gripper = ParallelGripper(settings, NAMES, self._part_of)
        self.simulation.add(self.carriage)
        self.simulation.add(self.gripper)
        self.simulation.reset()

    @property
    def part(self) -> int:
        return int(self.simulation.model.body(PART).id)

    @property
    def height(self) -> float:
        """Height of the part's origin [m]."""
        return float(self.simulation.data.qpos[self.simulation.model.joint(PART).qposadr[0] + 2])

    def run(self, seconds: float) -> None:
        self.simulation.step_until(self.simulation.now + nanoseconds(seconds))

    def grip(self, force: float | None = None, seconds: float = 1.2) -> None:
        self.gripper.grip(force)
        self.run(seconds)

    def lift(self) -> None:
        """Take the floor away."""
        model = self.simulation.model
        floor = int(model.geom("floor").id)
        model.geom_contype[floor] = model.geom_conaffinity[floor] = 0
        self.simulation.wake(self.part)

    def drive(self, way: float) -> None:
        """Drive the carriage away, along its axis."""
        self.carriage.acceleration, self.carriage.way, self.carriage.start = 0.0, way, self.simulation.now
        self.run(way / SPEED + 0.2)

    def shake(self, acceleration: float, cycles: int, quarter: float = 0.1) -> float:
        """Drive to and fro; return the largest displacement of the part in the palm [m]."""
        self.carriage.acceleration, self.carriage.quarter = acceleration, quarter
        self.carriage.start = self.simulation.now
        first, largest = self.place(), 0.0
        for _ in range(8 * cycles):
            self.run(quarter / 2)
            largest = max(largest, float(np.linalg.norm(self.place() - first)))
        return largest

    def place(self) -> Any:
        """Position of the part in the palm's frame [m]."""
        self.simulation.refresh()
        data, palm = self.simulation.data, int(self.simulation.model.body(NAMES.palm).id)
        rotation = data.xmat[palm].reshape(3, 3)
        return rotation.T @ (data.xpos[self.part] - data.xpos[palm])

    def _open(self, data: mujoco.MjData) -> None:
        for name in NAMES.joints:
            data.qpos[self.simulation.model.joint(name).qposadr[0]] = self.settings.opening / 2

    def _part_of(self, body: int) -> str | None:
        return PART if self.simulation.model.body(body).name == PART else None


def _model(settings: ParallelGripperSettings, load: Load | None, axis: Vector3) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    set_solver(spec, float(STEP))
    carriage = spec.worldbody.add_body(name="carriage", pos=(0.0, 0.0, HEIGHT))
    carriage.explicitinertial = True
    carriage.mass, carriage.inertia, carriage.gravcomp = CARRIAGE_MASS, (0.1, 0.1, 0.1), 1.0
    carriage.add_joint(name="carriage", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    servo = spec.add_actuator(name="carriage", trntype=mujoco.mjtTrn.mjTRN_JOINT, target="carriage")
    servo.set_to_pid(kp=CARRIAGE_MASS * BANDWIDTH**2, dampratio=1.0)
    down = Pose.from_rpy((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0))
    contacts = Contacts(Touch.ROBOT.value, contact_time(float(STEP)))
    flange = carriage.add_body(name="flange", quat=down.quaternion)
    add_parallel_gripper(spec, flange, settings, NAMES, contacts)
    middle = Pose((0.0, 0.0, HEIGHT)) @ down @ palm_T_grasp(settings)
    if load is not None:
        at_part = middle @ Pose(load.offset)
        part = spec.worldbody.add_body(name=PART, pos=at_part.position)
        part.add_freejoint(name=PART)
        for shape in load.shapes:
            add_shape(part, shape, Role.BOTH, Touch.PART, mass=load.mass)
        add_weld(spec, grip_name(PART), NAMES.palm, PART, contact_time(float(STEP)))
        if load.has_floor:
            below = min(shape.pose.position[2] - shape.half_extents[2] for shape in load.shapes)
            floor = box(1.0, 1.0, 0.02, at(z=at_part.position[2] + below - 0.01), (0.7, 0.7, 0.7, 1.0))
            add_shape(spec.worldbody, floor, Role.BOTH, name="floor")
    return spec.compile()
