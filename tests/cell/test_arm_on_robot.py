"""Arm on a link of a robot that is driven over its own topics: it goes where the robot bends."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from cellwright import Cell, Client
from cellwright.cell.interface.frames import fixed_arm_frames, robot_frames
from cellwright.cell.interface.parameters import robot_description
from cellwright.config.layout.arm_models import links_by_frame, mount_pose
from cellwright.config.layout.robots import CellRobot, robot_links
from cellwright.config.robot.robots import load_robot
from cellwright.middleware.messages.conversions import joint_state
from cellwright.running.run.collisions import CollisionWatch
from cellwright.util.pose import Pose
from tests.cell.robot_cells import arm_on_robot

WAIST = "J_waist_pitch"


def bend(cell: Cell, angle: float) -> None:
    """Bend the robot forward [rad]."""
    cell.bus.publish("/io_teleop/joint_cmd", joint_state([WAIST], [angle], time=0))


def test_arm_goes_along_within_10_mrad_and_the_robot_bends_too() -> None:
    trial = arm_on_robot()
    cell = Cell(trial)
    client = Client.in_process(cell)
    assert cell.arm is not None
    client.sleep(0.1)
    bend(cell, 0.4)
    worst = 0.0
    for _ in range(100):
        client.sleep(0.02)
        worst = max(worst, *map(abs, cell.arm.following().error[0]))
    assert 0.001 < worst < 0.010
    model, data = cell.simulation.model, cell.simulation.data
    assert data.joint(f"qinglong/{WAIST}").qpos[0] == pytest.approx(0.4, abs=1e-4)
    robot, config = trial.layout.robots[0], trial.robot_models["qinglong"]
    positions = {joint.name: float(data.joint(robot.prefix + joint.name).qpos[0]) for joint in config.robot.driven}
    expected = mount_pose(
        trial.arms[0], trial.arms, trial.arm_models, robots={"qinglong": robot_links(robot, config, positions)}
    )
    mount = data.body("arm/mount")
    assert tuple(mount.xpos) == pytest.approx(expected.position, abs=1e-9)
    assert abs(np.dot(mount.xquat, expected.quaternion)) == pytest.approx(1.0, abs=1e-9)
    assert model.body(int(model.body("arm/mount").parentid[0])).name == "qinglong/Link_waist_yaw"


def test_links_are_where_the_engine_has_them_as_a_run_begins() -> None:
    trial = arm_on_robot()
    data = Cell(trial).world.initial_data()
    robot, config = trial.layout.robots[0], trial.robot_models["qinglong"]
    for link, pose in robot_links(robot, config).items():
        assert tuple(data.body(robot.prefix + link).xpos) == pytest.approx(pose.position, abs=1e-9)
    assert tuple(data.body("arm/mount").xpos) == pytest.approx(trial.arms[0].pose.position, abs=1e-9)


def test_link_that_is_fixed_in_place_of_the_root_stays_there() -> None:
    config = load_robot("tandem", warn=lambda _line: None)
    first, *_, last = config.robot.driven
    config = replace(config, fixed_link=last.child)
    at = Pose.from_rpy((1.0, 2.0, 0.5), (0.0, 0.0, 0.3))
    found = robot_links(CellRobot("tandem", "tandem", at), config, {first.name: 0.1, last.name: 0.2})
    assert found[last.child].position == pytest.approx(at.position)
    assert found[last.child].quaternion == pytest.approx(at.quaternion)


def test_mount_has_its_frame_on_the_link_and_a_joint_that_says_that_it_moves() -> None:
    trial = arm_on_robot()
    cell = Cell(trial)
    mount = next(each for each in fixed_arm_frames(cell.simulation, trial) if each.child == "mount")
    assert mount.parent == "qinglong_Link_waist_yaw"
    assert mount.pose.position == pytest.approx((-0.35, 0.0, 0.3))
    assert mount.parent in {child for _, child, _, _ in robot_frames(cell.simulation, trial)()}
    assert '<joint name="mount_base_joint" type="floating">' in robot_description(trial)


def test_arm_and_robot_touch_but_for_the_mount() -> None:
    cell = Cell(arm_on_robot())
    client = Client.in_process(cell)
    watch = CollisionWatch(cell)
    client.sleep(0.1)
    mujoco.mj_forward(cell.simulation.model, cell.simulation.data)
    assert not cell.simulation.data.ncon
    places = dict(client.joint_positions) | {"shoulder_pan_joint": np.pi, "shoulder_lift_joint": -0.6}
    client.send_arm([[places[name] for name in client.joints]], [2.0])
    client.sleep(3.0)
    collisions = watch.end()
    assert any(each.owner == "arm" and each.obstacle.startswith("qinglong_") for each in collisions)
    # the cup's own contacts are not counted as the arm's
    links = links_by_frame(cell.trial.arms, cell.trial.arm_models).keys() - {"vacuum_gripper_link"}
    assert not [each for each in collisions if each.owner == "qinglong" and each.obstacle in links]


def test_run_begins_alike_after_a_reset() -> None:
    cell = Cell(arm_on_robot())
    client = Client.in_process(cell)
    hashes = []
    for _ in range(2):
        cell.reset()
        client.sleep(0.1)
        bend(cell, 0.2)
        client.sleep(0.5)
        hashes.append(cell.state_hash())
    assert hashes[0] == hashes[1]
