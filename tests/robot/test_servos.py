"""Servos against a plain version of their law; the recorded robot has its own tests."""

import copy
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Joint, JointType, Limits, Link, RobotModel
from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.robot_bodies import add_robot
from cellwright.robot.model import TIMESTEP, build_robot
from cellwright.robot.servos import GAIN, MAX_SPEED, JointServos, Motion, fastest
from tests.robot.bundled import qinglong
from tests.robot.robots import two_arms

DRY_FRICTION = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)


class Listener(Device):
    """Device that reads the constraints of the servos in the current step."""

    def __init__(self, servos: JointServos) -> None:
        super().__init__("listener")
        self.servos = servos
        self.steps = 0

    def drive(self) -> None:
        servos, data, model = self.servos, self.simulation.data, self.simulation.model
        requested = np.zeros(model.nv)
        for number, name in enumerate(servos.joints):
            joint = model.joint(name)
            top = fastest(two_arms().robot.joint(name))
            error = data.ctrl[model.actuator(name).id] - data.qpos[joint.qposadr[0]]
            speed = min(max(GAIN * error, -top), top)
            mimic = two_arms().robot.joint(name).mimic
            if mimic is not None:
                leader = servos.joints.index(mimic.joint)
                ahead = data.ctrl[leader] - data.qpos[model.joint(mimic.joint).qposadr[0]]
                leader_speed = fastest(two_arms().robot.joint(mimic.joint))
                place = mimic.multiplier * data.qpos[model.joint(mimic.joint).qposadr[0]] + mimic.offset
                speed = mimic.multiplier * min(max(GAIN * ahead, -leader_speed), leader_speed)
                speed += GAIN * (place - data.qpos[joint.qposadr[0]])
            requested[joint.dofadr[0]] = (speed - data.qvel[joint.dofadr[0]]) / model.opt.timestep
            assert number == model.actuator(name).id
        count = data.ne + data.nf
        drives = np.flatnonzero(data.efc_type[:count] == DRY_FRICTION)
        assert len(drives) == model.nv
        assert data.efc_aref[drives] == pytest.approx(requested[data.efc_id[drives]], abs=1e-9)
        self.steps += 1


def make_simulation(
    motion: Motion = Motion.SERVO, timestep: Fraction = TIMESTEP, config: RobotConfig | None = None
) -> tuple[Simulation, JointServos]:
    config = config or two_arms()
    world = build_robot(config, timestep=timestep)
    simulation = Simulation(world.model, timestep=timestep, first_pose=world.set_initial_posture)
    servos = JointServos(config.robot, motion)
    simulation.add(servos)
    simulation.reset()
    return simulation, servos


@pytest.mark.parametrize("timestep", [TIMESTEP, Fraction(1, 1000)])
def test_each_drive_requests_velocity_of_servo_law(timestep: Fraction) -> None:
    simulation, servos = make_simulation(timestep=timestep)
    listener = Listener(servos)
    simulation.add(listener)
    simulation.reset()
    rng = np.random.default_rng(3)
    for _ in range(4):
        low, high = np.maximum(servos.lower, -3.0), np.minimum(servos.upper, 3.0)
        servos.command(rng.uniform(low, high))
        simulation.step_until(simulation.now + 20_000_000)
    assert listener.steps >= 19


def test_drives_are_found_after_constraints_change() -> None:
    spec = mujoco.MjSpec()
    for name in ("free", "held"):
        body = spec.worldbody.add_body(name=f"link of {name}", mass=1.0, inertia=(0.1, 0.1, 0.1), explicitinertial=True)
        body.add_joint(
            name=name, axis=(0.0, 0.0, 1.0), frictionloss=50.0, solimp_friction=(0.9999, 0.9999, 1e-3, 0.5, 2.0)
        )
        spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    spec.option.gravity = (0.0, 0.0, 0.0)
    spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1="held", active=False)
    limits = Limits(-1.0, 1.0, effort=50.0, velocity=3.0)
    joints = tuple(
        Joint(name, JointType.REVOLUTE, "root", f"link of {name}", limits=limits) for name in ("free", "held")
    )
    robot = RobotModel("pair", "root", {name: Link(name) for name in ("root", "link of free", "link of held")}, joints)
    simulation = Simulation(spec.compile(), timestep=TIMESTEP)
    servos = JointServos(robot)
    simulation.add(servos)
    simulation.reset()
    for active, target in ((0, 0.2), (1, 0.4), (0, 0.6), (1, -0.3)):
        simulation.data.eq_active[0] = active
        servos.command(np.array([target, 0.0]))
        simulation.step_until(simulation.now + 600_000_000)
        assert simulation.data.ne == active
        assert servos.read().positions == pytest.approx([target, 0.0], abs=1e-3)


def falling_box(robots: Sequence[str]) -> tuple[Simulation, list[JointServos]]:
    """Robots on weightless links, by their prefixes, beside a box that falls onto the ground."""
    spec, config = mujoco.MjSpec(), two_arms()
    spec.compiler.degree = False
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0))
    for number, prefix in enumerate(robots):
        base = spec.worldbody.add_body(name=f"base of {prefix}", pos=(5.0 + 5.0 * number, 0.0, 3.0))

        def fill(body: Any, _link: Link) -> None:
            body.gravcomp = 1.0

        add_robot(spec, base, config, fill, extent=lambda _shapes: (0.1, 0.1, 0.1), prefix=prefix)
    box = spec.worldbody.add_body(name="box", pos=(0.0, 0.0, 0.5))
    box.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.05, 0.05, 0.05), mass=0.3)
    box.add_freejoint(name="box")
    simulation = Simulation(spec.compile())
    servos = [JointServos(config.robot, prefix=prefix) for prefix in robots]
    for each in servos:
        simulation.add(each)
    simulation.reset()
    return simulation, servos


def test_servos_of_two_robots_move_their_own_joints_alone() -> None:
    alone, _ = falling_box([])
    simulation, servos = falling_box(["one/", "other/"])
    targets = [each.targets for each in servos]
    for robot, target in zip(targets, (0.3, -0.2), strict=True):
        robot[servos[0].joints.index("shoulder_right")] = target
    for each, robot in zip(servos, targets, strict=True):
        each.command(robot)
    alone.step_until(1_500_000_000)
    simulation.step_until(1_500_000_000)
    for each, robot in zip(servos, targets, strict=True):
        assert each.read().positions == pytest.approx(robot, abs=1e-3)
    box, its_own = simulation.model.joint("box"), alone.model.joint("box")
    assert not simulation.model.dof_frictionloss[box.dofadr[0] : box.dofadr[0] + 6].any()
    place = simulation.data.qpos[box.qposadr[0] : box.qposadr[0] + 7]
    assert place == pytest.approx(alone.data.qpos[its_own.qposadr[0] : its_own.qposadr[0] + 7], abs=1e-9)
    assert place[2] == pytest.approx(0.05, abs=1e-3)  # it has fallen


def test_servos_go_on_with_a_larger_model() -> None:
    simulation, (servos,) = falling_box(["one/"])
    larger, _ = falling_box(["one/"])
    target = servos.targets
    target[servos.joints.index("shoulder_right")] = 0.3
    servos.command(target)
    simulation.step_until(100_000_000)
    simulation.grow(larger.model)
    simulation.step_until(1_500_000_000)
    assert servos.read().positions == pytest.approx(target, abs=1e-3)


def test_efforts_equal_engine_forces_within_limits() -> None:
    simulation, servos = make_simulation()
    target = servos.targets
    target[servos.joints.index("shoulder_right")] = 1.2
    servos.command(target)
    max_efforts = np.array([two_arms().robot.joint(name).limits.effort for name in servos.joints])
    largest = np.zeros(len(max_efforts))
    for _ in range(60):
        simulation.step()
        positions, _, efforts = servos.read()
        largest = np.maximum(largest, np.abs(efforts))
        expected = simulation.data.qfrc_constraint[servos._dof]
        alone = (positions > servos.lower + 0.01) & (positions < servos.upper - 0.01)  # no limit acts too
        assert efforts[alone] == pytest.approx(expected[alone], abs=1e-9)
    assert (largest <= max_efforts * (1 + 1e-9)).all()
    assert largest[servos.joints.index("shoulder_right")] > 1.0


def test_solver_start_changes_only_its_iterations() -> None:
    paths, iterations = [], []
    for is_commanded in (True, False):
        simulation, servos = make_simulation(config=qinglong())
        if not is_commanded:
            servos._attainable = np.zeros(simulation.model.nv)
        rng = np.random.default_rng(2)
        middle = (servos.lower + servos.upper) / 2
        count = 0
        for _ in range(40):
            servos.command(middle + rng.uniform(-0.05, 0.05, len(middle)))
            for _ in range(3):
                simulation.step()
                count += int(simulation.data.solver_niter.sum())
        paths.append(servos.read().positions)
        iterations.append(count)
    assert paths[0] == pytest.approx(paths[1], abs=1e-9)
    assert iterations[0] < 0.7 * iterations[1]


def test_teleport_places_joints_within_limits_in_one_step() -> None:
    simulation, servos = make_simulation(Motion.TELEPORT)
    target = servos.targets
    target[servos.joints.index("elbow_left")] = -5.0  # beyond its limit
    servos.command(target)
    simulation.step()
    read = servos.read()
    assert read.positions[servos.joints.index("elbow_left")] == pytest.approx(-2.0, abs=1e-6)
    assert np.abs(read.velocities).max() < 1e-6


def test_solver_iterations_suffice_for_saturated_drives() -> None:
    paths = []
    for iterations in (None, 1000):
        simulation, servos = make_simulation(config=qinglong())
        if iterations is not None:
            simulation.model.opt.iterations = iterations
        rng = np.random.default_rng(0)
        for _ in range(2):
            servos.command(rng.uniform(servos.lower, servos.upper))
            simulation.step_until(simulation.now + 500_000_000)
        paths.append(servos.read().positions)
    assert paths[0] == pytest.approx(paths[1], abs=1e-12)


def step_for(simulation: Simulation, seconds: float) -> None:
    simulation.step_until(simulation.now + round(seconds * 1e9))


def command_joints(servos: JointServos, **targets: float) -> None:
    """Command some joints."""
    requested = servos.targets
    for name, position in targets.items():
        requested[servos.joints.index(name)] = position
    servos.command(requested)


def at(servos: JointServos, name: str) -> float:
    return float(servos.read().positions[servos.joints.index(name)])


@pytest.mark.parametrize("timestep", [TIMESTEP, Fraction(1, 1000)])
def test_joint_moves_at_urdf_speed_and_arrives(timestep: Fraction) -> None:
    simulation, servos = make_simulation(timestep=timestep)
    command_joints(servos, waist=1.0, lift=0.3)
    step_for(simulation, 0.25)
    number = servos.joints.index("waist")
    assert servos.read().velocities[number] == pytest.approx(2.0, rel=0.01)
    assert at(servos, "waist") == pytest.approx(0.5, abs=0.02), "2 rad/s, less what the start took"
    step_for(simulation, 1.0)
    assert at(servos, "waist") == pytest.approx(1.0, abs=1e-4)
    assert at(servos, "lift") == pytest.approx(0.3, abs=1e-4)


def test_targets_are_clipped_to_joint_limits() -> None:
    simulation, servos = make_simulation()
    command_joints(servos, waist=50.0, head=-50.0)
    step_for(simulation, 2.0)
    assert at(servos, "waist") == pytest.approx(1.0, abs=1e-4)
    assert at(servos, "head") == pytest.approx(-1.5, abs=1e-4)


def test_weak_drive_arrives_later_within_effort_limit() -> None:
    times = {}
    for effort in (1.0, 80.0):
        joints = tuple(
            replace(joint, limits=replace(joint.limits, effort=effort)) if joint.name == "shoulder_left" else joint
            for joint in two_arms().robot.joints
        )
        config = replace(two_arms(), robot=replace(two_arms().robot, joints=joints))
        simulation, servos = make_simulation(config=config)
        command_joints(servos, shoulder_left=1.5)
        number = servos.joints.index("shoulder_left")
        while abs(at(servos, "shoulder_left") - 1.5) > 0.02:
            simulation.step()
            assert abs(servos.read().efforts[number]) <= effort * (1 + 1e-6)
            assert simulation.time < 10.0
        times[effort] = simulation.time
    assert times[1.0] > 1.5 * times[80.0]


def test_mimic_joint_ignores_its_own_target() -> None:
    simulation, servos = make_simulation()
    command_joints(servos, finger_left=0.04, thumb_left=0.0)
    for _ in range(60):
        simulation.step()
        assert at(servos, "thumb_left") == pytest.approx(at(servos, "finger_left"), abs=2e-3)
    assert at(servos, "thumb_left") == pytest.approx(0.04, abs=1e-3)


def test_placed_joint_stays_at_rest() -> None:
    simulation, servos = make_simulation()
    command_joints(servos, waist=1.0)
    step_for(simulation, 0.1)
    servos.place([servos.joints.index("waist"), servos.joints.index("finger_left")], [-0.7, 9.0])
    assert (at(servos, "waist"), at(servos, "finger_left"), at(servos, "thumb_left")) == (-0.7, 0.04, 0.04)
    step_for(simulation, 0.5)
    assert at(servos, "waist") == pytest.approx(-0.7, abs=1e-3)


@pytest.mark.parametrize("motion", list(Motion))
def test_same_targets_give_same_motion(motion: Motion) -> None:
    hashes = set()
    for _ in range(2):
        simulation, servos = make_simulation(motion)
        for number in range(100):
            command_joints(servos, waist=np.sin(number), elbow_right=-np.cos(number), finger_left=0.0002 * number)
            simulation.step()
        hashes.add(simulation.state_hash())
    assert len(hashes) == 1


@pytest.mark.parametrize("timestep", [Fraction(1, 100), TIMESTEP, Fraction(1, 10_000)])
def test_joints_without_limits_stay_below_default_speed(timestep: Fraction) -> None:
    joints = tuple(replace(joint, limits=Limits()) for joint in two_arms().robot.joints)
    config = replace(two_arms(), robot=replace(two_arms().robot, joints=joints), grippers=())
    simulation, servos = make_simulation(timestep=timestep, config=config)
    draw = np.random.default_rng(0)
    for _ in range(60):
        servos.command(draw.choice([-1e300, 1e4, 0.0, 1.0, -1e4], len(servos.joints)))
        for _ in range(5):
            simulation.step()
        assert np.abs(servos.read().velocities).max() < 11.0


def test_fastest_is_limited_by_engine_and_defaults() -> None:
    turning = Joint("a", JointType.REVOLUTE, "base", "link", limits=Limits(velocity=1e9))
    assert fastest(turning) == MAX_SPEED
    assert fastest(replace(turning, limits=Limits(velocity=3.0))) == 3.0
    assert fastest(replace(turning, limits=Limits())) == 10.0
    assert fastest(replace(turning, limits=Limits(), type=JointType.PRISMATIC)) == 1.0


def test_every_drive_gives_requested_velocity_or_its_whole_effort() -> None:
    simulation, servos = make_simulation(config=qinglong())
    model, data, rng = simulation.model, simulation.data, np.random.default_rng(5)
    names = [model.joint(joint).name for joint in range(model.njnt)]
    order = [servos.joints.index(name) for name in names]
    efforts = np.array([qinglong().robot.joint(name).limits.effort for name in names])
    top = np.array([fastest(qinglong().robot.joint(name)) for name in names])
    frictionless = copy.copy(model)
    frictionless.dof_frictionloss[:] = 0.0
    expected = mujoco.MjData(frictionless)
    direct = limited = 0
    for step in range(240):
        if step % 24 == 0:
            low, high = np.maximum(servos.lower, -1.0), np.minimum(servos.upper, 1.0)
            servos.command(servos.read().positions + 0.1 * (rng.uniform(low, high) - servos.read().positions))
        position, before = data.qpos.copy(), data.qvel.copy()
        requested = np.clip(GAIN * (servos.targets[order] - data.qpos), -top, top)
        simulation.step()
        if data.nf:  # the engine's solver made this step
            continue
        direct += 1
        given, shortfall = servos.read().efforts[order], requested - data.qvel
        is_limited = np.abs(given) >= efforts * (1 - 1e-9)
        limited += int(is_limited.sum())
        assert (np.abs(given) <= efforts * (1 + 1e-6)).all()
        assert shortfall[~is_limited] == pytest.approx(0.0, abs=1e-9)
        assert (shortfall[is_limited] * given[is_limited] >= 0.0).all()
        expected.qpos[:], expected.qvel[:], expected.qfrc_applied[:] = position, before, given
        mujoco.mj_forward(frictionless, expected)
        assert data.qvel == pytest.approx(before + expected.qacc / 240, abs=1e-6)
    assert direct > 200
    assert limited > 500


def test_force_from_outside_is_left_to_engine() -> None:
    simulation, servos = make_simulation()
    simulation.step()
    assert simulation.data.nf == 0
    simulation.data.qfrc_applied[servos._dof[servos.joints.index("shoulder_right")]] = 1e4
    simulation.step()
    assert simulation.data.nf == simulation.model.nv
    assert servos.read().velocities[servos.joints.index("shoulder_right")] > 0.0


def test_joint_beyond_its_limit_is_left_to_engine() -> None:
    simulation, servos = make_simulation()
    number = servos.joints.index("shoulder_right")
    simulation.step()
    simulation.data.qpos[servos._qpos[number]] = servos.upper[number] + 0.01
    simulation.step()
    assert simulation.data.nl == 1
    assert servos.read().velocities[number] < 0.0
