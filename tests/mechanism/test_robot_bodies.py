"""Robots in the engine; `tests/robot/test_model.py` has masses and joints of a robot alone in its world."""

import mujoco
import pytest

from cellwright.config.robot.config import initial_posture
from cellwright.mechanism.robot_bodies import UNLIMITED, add_robot
from tests.robot.robots import two_arms


def robot_with_prefix(prefix: str) -> mujoco.MjModel:
    spec, config = mujoco.MjSpec(), two_arms()
    spec.compiler.degree = False
    base = spec.worldbody.add_body(name="carrier of the robot")
    add_robot(spec, base, config, lambda _body, _link: None, extent=lambda _shapes: (0.1, 0.1, 0.1), prefix=prefix)
    return spec.compile()


@pytest.mark.parametrize("prefix", ["", "left/"])
def test_names_in_the_engine_have_the_prefix(prefix: str) -> None:
    model, robot = robot_with_prefix(prefix), two_arms().robot
    for joint in robot.driven:
        assert model.joint(f"{prefix}{joint.name}").id >= 0
        assert model.actuator(f"{prefix}{joint.name}").id >= 0
    assert {model.body(number).name for number in range(2, model.nbody)} == {f"{prefix}{name}" for name in robot.links}


def test_drives_have_efforts_of_joints() -> None:
    model, robot = robot_with_prefix(""), two_arms().robot
    for joint in robot.driven:
        effort = model.dof_frictionloss[model.joint(joint.name).dofadr[0]]
        assert effort == min(joint.limits.effort, UNLIMITED)


def test_robot_without_servos_holds_its_posture() -> None:
    model = robot_with_prefix("")
    data = mujoco.MjData(model)
    before = data.qpos.copy()
    for _ in range(100):
        mujoco.mj_step(model, data)
    assert data.qpos == pytest.approx(before, abs=0.02)


def test_initial_posture_is_within_limits_and_has_all_joints() -> None:
    config = two_arms()
    posture = initial_posture(config)
    assert set(posture) == {joint.name for joint in config.robot.driven}
    assert all(
        config.robot.joint(name).limits.lower <= place <= config.robot.joint(name).limits.upper
        for name, place in posture.items()
    )
