import math
from fractions import Fraction

import mujoco
import numpy as np
import pytest

from cellwright.config.robot.model import Joint, JointType, Limits
from cellwright.mechanism.inverse_kinematics import GAIN, ArmLimits, ArmSolver
from cellwright.robot.model import body_of, build_robot
from cellwright.robot.safety import TIP_SPEED, TIP_TURNING
from cellwright.util.pose import Pose
from tests.cell.model.robots import of_joints
from tests.robot.bundled import apart, posture_near_home, qinglong, tips
from tests.robot.robots import fixed, two_arms

STEP = 1 / 240
USUAL = TIP_SPEED, TIP_TURNING


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return build_robot(qinglong()).model


def solver_of(model: mujoco.MjModel, place: int = 0, caps: tuple[float, float] = USUAL) -> ArmSolver:
    config = qinglong()
    arm = config.arms[place]
    limits = [config.robot.joint(name).limits for name in arm.joints]
    return ArmSolver(
        model,
        joints=arm.joints,
        tip=arm.tip,
        reference="base_link",
        home=np.array(arm.home),
        limits=ArmLimits(
            lower=np.array([each.lower for each in limits]),
            upper=np.array([each.upper for each in limits]),
            velocity=np.array([each.velocity for each in limits]),
            caps=caps,
        ),
    )


def at(model: mujoco.MjModel, positions: dict[str, float]) -> mujoco.MjData:
    data = mujoco.MjData(model)
    for name, value in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    refresh(model, data)
    return data


def refresh(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)


def at_home(model: mujoco.MjModel) -> mujoco.MjData:
    return at(model, qinglong().start)


def test_solver_pose_equals_forward_kinematics(model: mujoco.MjModel) -> None:
    config = qinglong()
    posture = posture_near_home(config, np.random.default_rng(1), 1.0) | {"J_waist_yaw": 0.4, "J_head_yaw": 0.3}
    data = at(model, posture)
    for place, expected in enumerate(tips(config, posture)):
        solver = solver_of(model, place)
        assert apart(solver.pose(data), expected) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert apart(solver.pose(data, config.arms[place].tip), expected) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert apart(solver.pose(data, "base_link"), Pose()) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_error_is_along_world_axes(model: mujoco.MjModel) -> None:
    solver, data = solver_of(model), at_home(model)
    tip = solver.pose(data)
    # the base is turned by 90 degrees: its x axis is the world's y axis
    target = Pose((0.01, 0.0, 0.0)) @ tip
    assert solver.error(data, target) == pytest.approx([0.0, 0.01, 0.0, 0.0, 0.0, 0.0], abs=1e-9)
    turned = Pose(
        tip.position, (Pose.from_rpy((0.0, 0.0, 0.0), (0.02, 0.0, 0.0)) @ Pose(quaternion=tip.quaternion)).quaternion
    )
    assert solver.error(data, turned) == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.02, 0.0], abs=1e-9)


def test_step_reduces_error_by_gain(model: mujoco.MjModel) -> None:
    solver, data = solver_of(model), at_home(model)
    target = Pose((0.002, -0.001, 0.002)) @ solver.pose(data) @ Pose.from_rpy((0.0, 0.0, 0.0), (0.01, 0.0, -0.005))
    before = solver.error(data, target)
    data.qpos[solver.qpos] += solver.step(data, target, STEP)
    refresh(model, data)
    left = solver.error(data, target) / math.exp(-GAIN * STEP)
    assert left == pytest.approx(before, abs=0.02 * float(np.abs(before).max()))


@pytest.mark.parametrize(("caps", "limits"), [((0.1, TIP_TURNING), (0.1, 9.9)), ((TIP_SPEED, 0.2), (2.0, 0.2))])
def test_caps_limit_translation_and_rotation_together(
    model: mujoco.MjModel, caps: tuple[float, float], limits: tuple[float, float]
) -> None:
    solver, data = solver_of(model, caps=caps), at_home(model)
    start = solver.pose(data)
    target = Pose((0.05, 0.0, 0.05)) @ start @ Pose.from_rpy((0.0, 0.0, 0.0), (0.3, 0.0, 0.0))
    data.qpos[solver.qpos] += solver.step(data, target, STEP)
    refresh(model, data)
    distance, turn = apart(start, solver.pose(data))
    assert distance <= limits[0] * STEP * 1.02
    assert turn <= limits[1] * STEP * 1.02
    assert max(distance / limits[0], turn / limits[1]) > 0.9 * STEP


@pytest.mark.parametrize("seed", range(6))
def test_steps_never_leave_the_limits(model: mujoco.MjModel, seed: int) -> None:
    rng = np.random.default_rng(seed)
    solver = solver_of(model, seed % 2, (math.inf, math.inf))
    data = at(model, posture_near_home(qinglong(), rng, 3.0))
    bound = np.array([qinglong().robot.joint(name).limits.velocity for name in qinglong().arms[seed % 2].joints]) * STEP
    target = Pose(tuple(rng.uniform(-1, 1, 3)), tuple((q := rng.normal(size=4)) / np.linalg.norm(q)))
    for _ in range(100):
        step = solver.step(data, target, STEP)
        data.qpos[solver.qpos] += step
        refresh(model, data)
        assert (np.abs(step) <= bound + 1e-9).all()
        position = data.qpos[solver.qpos]
        assert ((position >= solver.limits.lower - 1e-9) & (position <= solver.limits.upper + 1e-9)).all()


def test_redundant_arm_moves_home_while_tip_stays(model: mujoco.MjModel) -> None:
    solver, data = solver_of(model), at_home(model)
    displaced = at_home(model)
    target = solver.pose(data)
    displaced.qpos[solver.qpos] += (0.3, 0.2, -0.2, 0.3, 0.2, 0.1, 0.2)
    refresh(model, displaced)
    for _ in range(1200):
        displaced.qpos[solver.qpos] += solver.step(displaced, target, STEP)
        refresh(model, displaced)
    assert apart(solver.pose(displaced), target) == pytest.approx((0.0, 0.0), abs=1e-4)
    assert displaced.qpos[solver.qpos] == pytest.approx(data.qpos[solver.qpos], abs=0.02)  # it rests with a small error


def test_stretched_arm_returns_without_jump(model: mujoco.MjModel) -> None:
    solver = solver_of(model)
    data = at(model, {"J_arm_r_01": 1.5})  # all else at 0: elbow straight, wrist in line
    target = Pose((0.0, 0.0, 0.05)) @ solver.pose(data)
    steps = []
    for _ in range(960):
        steps.append(solver.step(data, target, STEP))
        data.qpos[solver.qpos] += steps[-1]
        refresh(model, data)
    assert np.abs(np.diff(steps, axis=0)).max() < 0.006  # 1.4 rad/s from tick to tick, out of a singular posture
    assert solver.error(data, target) == pytest.approx([0.0] * 6, abs=1e-3)


def test_reference_link_moved_by_arm_is_followed() -> None:
    # fixed at its right hand the robot moves all else with that arm: the torso, in whose frame its tip is given
    config = fixed(two_arms(), "hand_right")
    model = build_robot(config, timestep=Fraction(1, 240)).model
    arm = config.arms[0]
    wide = np.full(3, math.inf)
    solver = ArmSolver(
        model, joints=arm.joints, tip=arm.tip, reference="torso", home=np.array(arm.home),
        limits=ArmLimits(-wide, wide, wide, USUAL),
    )  # fmt: skip
    data = at(model, config.start)
    target = at(model, config.start | {"shoulder_right": 0.6, "elbow_right": -0.9})
    goal = solver.pose(target)
    for _ in range(240):
        data.qpos[solver.qpos] += solver.step(data, goal, STEP)
        refresh(model, data)
    assert apart(solver.pose(data), goal) == pytest.approx((0.0, 0.0), abs=1e-5)


def test_solver_accepts_links_with_reserved_names() -> None:
    joints = ("shoulder", "elbow")
    config = of_joints(
        Joint("shoulder", JointType.REVOLUTE, "world", "arm", Pose((0.0, 0.0, 0.5)), limits=Limits(-2.0, 2.0)),
        Joint("elbow", JointType.REVOLUTE, "arm", "hand", Pose((0.0, 0.0, 0.3)), limits=Limits(-2.0, 2.0)),
        base_pose=Pose((3.0, 2.0, 1.0)),
    )
    model = build_robot(config).model
    bounds = np.full(2, 2.0)
    solver = ArmSolver(
        model,
        joints=joints,
        tip="hand",
        reference=body_of("world"),
        home=np.zeros(2),
        limits=ArmLimits(-bounds, bounds, bounds, USUAL),
    )
    assert solver.pose(at(model, {})).position == pytest.approx((0.0, 0.0, 0.8))
    assert solver.pose(at(model, {}), "arm").position == pytest.approx((0.0, 0.0, 0.5))


def test_arm_stands_still_without_solution(model: mujoco.MjModel, monkeypatch: pytest.MonkeyPatch) -> None:
    solver, data = solver_of(model), at_home(model)
    target = Pose((0.1, 0.0, 0.0)) @ solver.pose(data)
    monkeypatch.setattr("daqp.solve", lambda *_: (np.full(7, math.nan), 0.0, -4, {}))
    assert solver.step(data, target, STEP).tolist() == [0.0] * 7
