"""Arm on a link of another arm: it goes where that takes it, and all that depends on its base follows."""

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest

from cellwright import Cell, Client
from cellwright.cell.checks.clearance import place_reaches
from cellwright.cell.checks.findings import findings
from cellwright.cell.devices.arm_guard import ArmDistances
from cellwright.cell.entities import Entities
from cellwright.cell.interface.frames import fixed_arm_frames
from cellwright.cell.interface.parameters import robot_description
from cellwright.cell.model.build import build_world
from cellwright.clients.client import ClientArm
from cellwright.config.layout.arm_models import laden, mount_pose
from cellwright.config.robot.model import RobotModel, link_poses
from cellwright.config.robot.urdf import read_urdf
from cellwright.mechanism.drives import stiff_drives
from cellwright.mechanism.mounted_arm import mounted_arm
from cellwright.running.run.collisions import CollisionWatch
from cellwright.util.pose import Pose
from tests.cell.arm_cells import carried_cell

PART = "bin1|gear_part_1"


def send(arm: ClientArm, duration: float, **joints: float) -> None:
    """Send an arm so that some joints come to positions [rad; m], by their names without the prefix."""
    prefix = arm.joints[0].partition("_")[0]
    wanted = {f"{prefix}_{name}": value for name, value in joints.items()}
    arm.send_arm([[{**arm.joint_positions, **wanted}[name] for name in arm.joints]], [duration])


def plain(positions: Mapping[str, float], prefix: str) -> dict[str, float]:
    return {name.removeprefix(prefix): value for name, value in positions.items()}


def read(folder: Path, text: str) -> RobotModel:
    """Return the robot of a description."""
    path = folder / "robot.urdf"
    path.write_text(text)
    return read_urdf(path, warn=lambda _line: None)


def test_base_goes_along_and_the_arm_keeps_its_posture() -> None:
    trial = carried_cell("tool0", "[0, 0, 0.05]", 1.5)
    cell = Cell(trial)
    client = Client.in_process(cell)
    gantry, small = client.arm("gantry"), client.arm("small")
    client.sleep(0.1)
    before = dict(small.joint_positions)
    send(gantry, 4.0, rail_joint=0.6, shoulder_pan_joint=1.0, wrist_3_joint=-0.4)
    client.sleep(5.0)
    for name, position in small.joint_positions.items():
        assert position == pytest.approx(before[name], abs=1e-4)
    positions = {"gantry": plain(gantry.joint_positions, "gantry_")}
    expected = mount_pose(trial.arms[1], trial.arms, trial.arm_models, positions)
    base = cell.simulation.data.body("small/base_link")
    assert tuple(base.xpos) == pytest.approx(expected.position, abs=1e-9)
    assert abs(np.dot(base.xquat, expected.quaternion)) == pytest.approx(1.0, abs=1e-9)
    assert mount_pose(trial.arms[1], trial.arms, trial.arm_models) == trial.arms[1].pose
    # the mount and the flange that carries it overlap, and do not touch
    assert not cell.simulation.data.ncon


def test_drives_of_the_carrier_know_its_load() -> None:
    trial = carried_cell()
    gantry, small = trial.arms
    alone = stiff_drives(laden(gantry, (gantry,), trial.arm_models))
    loaded = stiff_drives(laden(gantry, trial.arms, trial.arm_models))
    mass = sum(link.inertial.mass for link in laden(small, (), trial.arm_models).links.values() if link.inertial)
    more = loaded["gantry/rail_joint"].p - alone["gantry/rail_joint"].p
    assert more == pytest.approx(80.0**2 * mass, rel=1e-3)
    assert loaded["gantry/elbow_joint"].p == pytest.approx(alone["gantry/elbow_joint"].p, rel=1e-9)
    model = build_world(trial).model
    assert model.actuator("gantry/rail_joint").biasprm[1] == -loaded["gantry/rail_joint"].p


def test_frames_and_descriptions_hang_on_the_link(tmp_path: Path) -> None:
    trial = carried_cell("tool0", "[0, 0, 0.05]", 1.5)
    cell = Cell(trial)
    mount = next(each for each in fixed_arm_frames(cell.simulation, trial) if each.child == "small_mount")
    assert mount.parent == "gantry_tool0"
    assert mount.pose.position == pytest.approx((0.0, 0.0, 0.05))
    whole = read(tmp_path, robot_description(trial))
    joint = next(each for each in whole.joints if each.child == "small_mount")
    assert joint.parent == "gantry_tool0"
    home = {f"{arm.name}_{name}": value for arm in trial.arms for name, value in arm.home.items()}
    assert link_poses(whole, home)["small_mount"].position == pytest.approx(trial.arms[1].pose.position, abs=1e-9)
    # alone it has no place in the world
    assert read(tmp_path, robot_description(trial, trial.arms[1])).root == "small_mount"
    assert read(tmp_path, robot_description(trial, trial.arms[0])).root == "world"
    assert "small" in Entities(cell).names()


def test_part_is_picked_from_where_the_carrier_has_brought_the_arm() -> None:
    trial = carried_cell()
    cell = Cell(trial)
    client = Client.in_process(cell)
    gantry, small = client.arm("gantry"), client.arm("small")
    client.start_competition()
    client.sleep(0.1)
    send(gantry, 2.0, rail_joint=0.7, shoulder_pan_joint=2.5)
    client.sleep(2.5)
    positions = {"gantry": plain(gantry.joint_positions, "gantry_")}
    mount = mount_pose(trial.arms[1], trial.arms, trial.arm_models, positions)
    arm = mounted_arm(trial.arms[1], trial.arm_models, mount)
    x, y, z = cell.parts.pose(cell.parts.part(PART)).position
    small.control_gripper(True)
    for height, duration in ((0.15, 2.0), (0.0135, 1.0)):
        tool = Pose.from_rpy((x, y, z + height), (np.pi, 0.0, 0.0))
        place = next(iter(arm.mount.places(tool, 0.0)))
        q = next(iter(arm.solver.branches(place.world_T_base.inverse() @ tool, arm.home)))
        send(small, duration, **arm.joints(0.0, q))
        client.sleep(duration + 0.5)
    assert small.gripper_attached
    send(gantry, 2.0, rail_joint=0.2)
    client.sleep(2.5)
    held = cell.simulation.data.body(cell.parts.part(PART).name).xpos
    assert held[1] == pytest.approx(y - 0.5, abs=0.01)


def test_arms_touch_but_for_the_mount() -> None:
    cell = Cell(carried_cell("tool0", "[0, 0, 0.02]", 1.5))
    client = Client.in_process(cell)
    watch = CollisionWatch(cell)
    small = client.arm("small")
    client.sleep(0.1)
    distances = ArmDistances(cell.simulation, cell.trial)
    assert (found := distances.nearest("gantry", "small")) is not None
    assert found.distance > 0.0
    # the small arm bends back on the arm below it
    send(small, 2.0, shoulder_lift_joint=0.8, elbow_joint=2.6)
    client.sleep(3.0)
    collisions = watch.end()
    assert collisions
    assert all(each.link[:6] in ("gantry", "small_") and "mount" not in each.link for each in collisions)


def test_guard_stops_an_arm_before_it_meets_the_one_below_it() -> None:
    cell = Cell(carried_cell("tool0", "[0, 0, 0.02]", 1.5, "  arm_clearance: 0.01\n"))
    client = Client.in_process(cell)
    assert cell.arm_guard is not None
    small, lines = client.arm("small"), list[str]()
    cell.arm_guard.on_stop.append(lines.append)
    client.sleep(0.1)
    send(small, 3.0, shoulder_lift_joint=0.8, elbow_joint=2.6)
    client.sleep(4.0)
    assert lines
    assert lines[0].startswith("small stopped")
    assert not cell.simulation.data.ncon


def test_reach_is_that_with_the_carrier_at_home_and_no_place_is_called_out_of_reach() -> None:
    trial = carried_cell()
    far = {each.arm: each.reached for each in place_reaches(trial)}
    assert far["gantry"] > 0.5
    assert far["small"] < 0.5
    assert not [each for each in findings(trial) if "out of reach" in each.message]


def test_run_goes_on_alike_after_a_reset() -> None:
    cell = Cell(carried_cell())
    client = Client.in_process(cell)
    gantry, small = client.arm("gantry"), client.arm("small")
    hashes = []
    for _ in range(2):
        cell.reset(joints={"gantry/rail_joint": 0.4})
        client.sleep(0.1)
        assert cell.simulation.data.body("small/base_link").xpos[1] == pytest.approx(-0.2, abs=1e-6)
        send(gantry, 1.0, rail_joint=0.0)
        send(small, 1.0, elbow_joint=1.0)
        client.sleep(1.5)
        hashes.append(cell.state_hash())
    assert hashes[0] == hashes[1]


def test_engine_has_the_joints_of_each_arm_side_by_side() -> None:
    model = build_world(carried_cell("forearm_link", "[0.1, 0, 0.2]")).model
    names = [model.joint(number).name.partition("/")[0] for number in range(13)]
    assert names == ["gantry"] * 7 + ["small"] * 6
    assert mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "small/mount") > 0
    assert model.body(int(model.body("small/mount").parentid[0])).name == "gantry/forearm_link"
