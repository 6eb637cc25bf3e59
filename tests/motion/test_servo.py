"""Tracking of a real cell's arm, with and without anticipation."""

import math
from dataclasses import replace

import mujoco
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.model.arm import add_arm
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.arm import ArmSettings, ServoProfile
from cellwright.config.ur10 import UR10
from cellwright.engine.shapes import Visuals
from cellwright.motion import (
    ORIGINAL_SERVO,
    JointMotion,
    Joints,
    MovingPart,
    along,
    anticipated,
    forward,
    intercept,
    move,
    solve,
    straight,
    tool_down,
)
from cellwright.motion.joints import STILL
from cellwright.motion.servo import weight
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.motion.samples import ABOVE_BELT, ABOVE_BIN, INITIAL
from tests.support.cells import ARM_ONLY
from tests.support.places import LAYOUT

ALONG_THE_RAIL = move(ABOVE_BIN, ABOVE_BIN._replace(rail=ABOVE_BIN.rail + 0.5))
DOWN = along(straight(ABOVE_BIN, tool_down(-0.3, 0.23, 0.8)))


def tool_errors(motion: JointMotion, command: JointMotion, servo: ServoProfile = "original") -> tuple[float, float]:
    """Return the distance of the gripper from its target [mm]: the maximum on its path, and half a second after."""
    cell = Cell(replace(ARM_ONLY, initial_joint_states=motion.start.by_name()), servo=servo)
    cell.reset()
    arm = cell.arm
    assert arm is not None
    client = Client(InProcess(cell))
    client.sleep(0.3)
    started = cell.simulation.time
    client.send_arm(**command.command())
    worst = error = 0.0
    while (time := cell.simulation.time - started) < motion.duration + 0.5:
        cell.step()
        time = cell.simulation.time - started
        gripper = forward(Joints(*arm.read().positions))
        error = 1000 * math.dist(gripper.position, forward(motion.at(time).positions).position)
        if time <= motion.duration:
            worst = max(worst, error)
    client.close()
    return worst, error


def test_precise_servo_follows_as_commanded() -> None:
    worst, remaining = tool_errors(ALONG_THE_RAIL, ALONG_THE_RAIL, "precise")
    assert worst < 1.0
    assert remaining < 0.1
    worst, remaining = tool_errors(DOWN, DOWN, "precise")
    assert worst < 1.0
    assert remaining < 0.1


def test_original_rail_lags_without_anticipation() -> None:
    worst, remaining = tool_errors(ALONG_THE_RAIL, ALONG_THE_RAIL)
    assert worst > 15.0
    assert remaining < 2.0
    worst, remaining = tool_errors(ALONG_THE_RAIL, anticipated(ALONG_THE_RAIL))
    assert worst < 4.0
    assert remaining < 1.0


def test_original_arm_sags_without_anticipation() -> None:
    _, remaining = tool_errors(DOWN, DOWN)
    assert 1.0 < remaining < 3.0
    worst, remaining = tool_errors(DOWN, anticipated(DOWN))
    assert worst < 2.0
    assert remaining < 0.2


def test_anticipated_interception_meets_part_within_millimetres() -> None:
    part = MovingPart(Pose((1.21, 2.6, 1.0)), 0.0, (0.0, -0.2, 0.0))  # higher than the belt, so that nothing is touched
    plan = intercept(part, tool_down(0.0, 0.0, 0.0), ABOVE_BELT, 0.0, window=(0.0, 2.5))
    worst, remaining = tool_errors(plan.motion, anticipated(plan.motion))
    assert worst < 6.0
    assert remaining < 2.0


def test_weight_equals_bias_forces_of_engine() -> None:
    spec = mujoco.MjSpec()
    add_arm(spec, Visuals(), ArmSettings(), 0.01, LAYOUT.arms[0])
    model = spec.compile()
    data = mujoco.MjData(model)
    joints = Joints(0.7, -1.0, -0.6, 1.9, 0.4, 1.2, -3.0)
    for joint, value in zip(UR10.driven, joints, strict=True):
        data.joint(joint.name).qpos[0] = value
    mujoco.mj_forward(model, data)
    needed = [float(data.joint(joint.name).qfrc_bias[0]) for joint in UR10.driven]
    assert weight(joints) == pytest.approx(needed, rel=1e-3, abs=0.01)
    assert weight(joints.by_name()) == weight(joints)


def test_payload_loads_every_joint_before_it() -> None:
    stretched = Joints(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    reach = forward(stretched).position[0] - 0.3
    assert weight(stretched, 0.5).shoulder_lift - weight(stretched).shoulder_lift == pytest.approx(-0.5 * 9.81 * reach)
    assert weight(stretched, 0.5).rail == weight(stretched, 0.5).shoulder_pan == 0.0


def test_anticipated_command_ends_at_target_plus_weight_lead() -> None:
    command = anticipated(DOWN)
    assert command.duration > DOWN.duration
    assert command.velocities[-1] == STILL
    for p, q, f, k in zip(command.end, DOWN.end, weight(DOWN.end), ORIGINAL_SERVO.stiffness, strict=True):
        assert p == pytest.approx(q + f / k)


def test_anticipated_refuses_motion_that_does_not_end_at_rest() -> None:
    moving = move(INITIAL, ABOVE_BIN, goal_velocity=STILL._replace(rail=0.1))
    with pytest.raises(UsageError, match="rest"):
        anticipated(moving)
    assert anticipated(JointMotion.hold(INITIAL, 0.0)).duration > 0.0
    assert solve(forward(INITIAL), INITIAL, rail=0.0) == pytest.approx(INITIAL)
