"""Speed of a robot's whole node compared with PyBullet, the engine of the original io_teleop node.

Both load the same URDF, fixed at its root, without gravity, with a position drive at every joint. Ours is the node as
served: commands on the bus, commander, servos, and joint_states at 100 Hz for one subscriber. PyBullet is driven as in
the original: without a display, `setJointMotorControl2` for each commanded joint, `getJointStates` 100 times a second,
and no messages.

At rest there are no commands; in motion, all joints follow sines at 100 Hz, which go on from one repeat to the next.
The repeats run in turn and the best of each counts, in processor time.

Nodes of robots with 10 to 60 joints in limbs of five show the cost of a joint. The bound on growth compares the largest
robot with a straight line through the smallest and the one of half its joints.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from benchmarks.benchmarks import Curve, Figure, OnProgress
from benchmarks.silence import without_output
from benchmarks.timing import best_in_turn, processor_time
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel
from cellwright.config.robot.robots import load_robot
from cellwright.middleware.messages.conversions import joint_state
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.util.pose import Pose

ROBOT = "qinglong"
SECONDS, REPEATS, GROWTH_REPEATS = 2.0, 3, 5
PERIOD = Fraction(1, 100)
"""Period of commands and joint states [s]."""
RATES = (240, 1000)
MIN_RATIO, MIN_SPEED = 25.0, 60.0
"""Required speed of the moving node at 240 Hz, compared with PyBullet and with real time."""
JOINTS, LIMB = (10, 20, 30, 45, 60), 5
"""Numbers of joints of the robots of growing size, and joints of a limb."""
MAX_BEND = 1.2
"""Required straightness of the cost with the number of joints."""

Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


class Sines:
    """Targets of all joints: sines of different speed about the middle of each joint's range."""

    def __init__(self, config: RobotConfig) -> None:
        joints = [joint for joint in config.robot.driven if joint.mimic is None]
        self.names = [joint.name for joint in joints]
        lower = np.array([max(joint.limits.lower, -1.0) for joint in joints])
        upper = np.array([min(joint.limits.upper, 1.0) for joint in joints])
        self._middle, self._reach = (lower + upper) / 2, (upper - lower) / 2
        self._pulse = 2 * math.pi * np.linspace(0.2, 0.6, len(joints))

    def at(self, time: float) -> Array:
        """Return the targets of the joints [rad; m]."""
        targets: Array = self._middle + 0.8 * self._reach * np.sin(self._pulse * time)
        return targets


class NodeSide:
    """The node.

    Attributes:
        steps: steps in motion so far.
    """

    steps = 0

    def __init__(self, config: RobotConfig, rate: int, sines: Sines) -> None:
        self.node = RobotNode(config, RobotSettings(timestep=Fraction(1, rate)))
        self.sines = sines
        self.received = 0
        self.node.bus.subscribe("/io_teleop/joint_states", self._receive)

    def _receive(self, _message: object) -> None:
        self.received += 1

    def command(self, time: float) -> None:
        """Publish targets of all joints, as a client does."""
        self.node.bus.publish("/io_teleop/joint_cmd", joint_state(self.sines.names, self.sines.at(time), time=0))

    def close(self) -> None:
        """Do nothing: there is nothing to release."""

    def step(self) -> None:
        """Take one step; the node publishes its joint states itself."""
        self.node.simulation.step()

    def read_joints(self) -> None:
        """Do nothing: the listener has had the joint states already."""


class PyBulletSide:
    """PyBullet, driven as the original drives it.

    Attributes:
        steps: steps in motion so far.
    """

    steps = 0

    def __init__(self, config: RobotConfig, rate: int, sines: Sines) -> None:
        with without_output():
            import pybullet
        self.engine, self.sines = pybullet, sines
        self.client = pybullet.connect(pybullet.DIRECT)
        pybullet.setTimeStep(1 / rate, physicsClientId=self.client)
        with without_output():
            pose: Pose = config.base_pose
            w, x, y, z = pose.quaternion
            self.robot = pybullet.loadURDF(
                str(config.urdf_path), pose.position, (x, y, z, w), useFixedBase=True, physicsClientId=self.client
            )
        count = pybullet.getNumJoints(self.robot, physicsClientId=self.client)
        infos = [pybullet.getJointInfo(self.robot, index, physicsClientId=self.client) for index in range(count)]
        self.moving = [info[0] for info in infos if info[2] != pybullet.JOINT_FIXED]
        by_name = {info[1].decode(): info for info in infos}
        self.driven = [(by_name[name][0], by_name[name][10], by_name[name][11]) for name in sines.names]
        self.command(0.0)

    def command(self, time: float) -> None:
        """Give each joint its target, with the URDF's effort and velocity."""
        for (index, effort, velocity), target in zip(self.driven, self.sines.at(time).tolist(), strict=True):
            self.engine.setJointMotorControl2(
                self.robot,
                index,
                self.engine.POSITION_CONTROL,
                targetPosition=target,
                maxVelocity=velocity,
                force=effort,
                physicsClientId=self.client,
            )

    def step(self) -> None:
        """Take one step."""
        self.engine.stepSimulation(physicsClientId=self.client)

    def close(self) -> None:
        """Disconnect from the engine."""
        self.engine.disconnect(physicsClientId=self.client)

    def read_joints(self) -> None:
        """Read all joints, as for each joint_states."""
        self.engine.getJointStates(self.robot, self.moving, physicsClientId=self.client)


def time_of(side: NodeSide | PyBulletSide, rate: int, steps: int, *, moving: bool) -> float:
    """Return the processor time of some steps [s]."""
    due = {step for step in range(steps) if step == 0 or step * 100 // rate != (step - 1) * 100 // rate}

    def run() -> None:
        for step in range(steps):
            if step in due:
                if moving:
                    side.command((side.steps + step) / rate)
                side.read_joints()
            side.step()
        side.steps += steps if moving else 0

    return processor_time(run)


def many_limbs(count: int) -> RobotConfig:
    """Return a robot with a number of joints, in limbs side by side on its root."""
    joints, links = [], {"root": Link("root")}
    for number in range(count):
        limb, place = divmod(number, LIMB)
        parent, origin = (
            (f"link_{number - 1}", Pose((0.0, 0.0, 0.2))) if place else ("root", Pose((0.3 * limb, 0.0, 0.0)))
        )
        axis = (1.0, 0.0, 0.0) if place % 2 else (0.0, 1.0, 0.0)
        limits = Limits(-1.5, 1.5, effort=100.0, velocity=3.0)
        joints.append(Joint(f"joint_{number}", JointType.REVOLUTE, parent, f"link_{number}", origin, axis, limits))
        inertial = Inertial(1.0, Pose((0.0, 0.0, 0.1)), (0.01, 0.01, 0.001, 0.0, 0.0, 0.0))
        links[f"link_{number}"] = Link(f"link_{number}", inertial)
    robot, path = RobotModel("limbs", "root", links, tuple(joints)), Path("limbs.urdf")
    return RobotConfig(robot, "limbs", path, path)


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure | Curve]:
    """Step both, at rest and moving, without PyBullet the node alone; then nodes of growing size."""
    config = load_robot(ROBOT, lambda _line: None)
    sines = Sines(config)
    kinds: list[Callable[[RobotConfig, int, Sines], NodeSide | PyBulletSide]] = [NodeSide]
    if find_spec("pybullet") is not None:
        kinds.append(PyBulletSide)
    for rate in RATES[:1] if quick else RATES:
        on_progress(f"{config.name} at {rate} Hz, {len(sines.names)} joints")
        sides = [kind(config, rate, sines) for kind in kinds]
        steps = 10 if quick else round(SECONDS * rate)
        for moving in (False, True):
            works = [partial(time_of, side, rate, steps, moving=moving) for side in sides]
            times = best_in_turn(1 if quick else REPEATS, *works)
            speeds = [steps / each for each in times]
            case = f"{rate} Hz, {'moving' if moving else 'at rest'}"
            yield from figures(case, rate, speeds, is_bound=moving and rate == RATES[0])
        for side in sides:
            side.close()
    sizes = (*JOINTS[:2], JOINTS[-1]) if quick else JOINTS
    on_progress(f"{', '.join(map(str, sizes))} joints")
    nodes = []
    for size in sizes:
        robot = many_limbs(size)
        nodes.append(NodeSide(robot, RATES[0], Sines(robot)))
    steps = 10 if quick else round(SECONDS * RATES[0])
    times = best_in_turn(
        1 if quick else GROWTH_REPEATS, *(partial(time_of, node, RATES[0], steps, moving=True) for node in nodes)
    )
    curve = Curve("step, moving", "joint", "us/step", sizes, tuple(each / steps * 1e6 for each in times))
    yield curve
    yield from curve.figures(MAX_BEND)


def figures(case: str, rate: int, found: list[float], *, is_bound: bool) -> Iterator[Figure]:
    """Yield the figures of one case, from the steps per second of each side; with bounds or for information."""
    least = MIN_SPEED if is_bound else None
    for name, speed in zip(("the node", "PyBullet"), found, strict=False):
        yield Figure(f"{case}: {name}", speed / rate, "x real time", minimum=least, note=f"{speed:.0f} steps/s")
        least = None
    if len(found) > 1:
        yield Figure(f"{case}: the node / PyBullet", found[0] / found[1], minimum=MIN_RATIO if is_bound else None)
    else:
        yield Figure(f"{case}: the node / PyBullet", math.nan, note="PyBullet is not installed")
