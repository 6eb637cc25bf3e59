"""ROS parameters of the cell."""

from __future__ import annotations

import xmlrpc.client
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.interface.parameters import own_description, parameters, robot_description
from cellwright.config.arm import ArmSettings, JointGains, JointTolerance
from cellwright.config.robot.model import link_poses
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.trial.trial import CellSettings
from tests.cell.robot_cells import BESIDE_ARM, tandem_cell
from tests.support.cells import ARM_ONLY, BARE, JOINTS, WHOLE


def arm_parameters(settings: ArmSettings) -> Any:
    found: Any = parameters(replace(ARM_ONLY, settings=CellSettings(arm=settings)), competition=False)
    return found["ariac"]["arm"]


def test_every_cell_has_sim_time_and_robot_description() -> None:
    for trial in (WHOLE, BARE):
        found: Any = parameters(trial, competition=True)
        assert found["use_sim_time"] is True
        assert found["robot_description"] == found["ariac"]["robot_description"] == robot_description(trial)


def test_gazebo_ros_network_is_enabled_outside_competition_only() -> None:
    for competition in (True, False):
        found: Any = parameters(BARE, competition=competition)
        assert found["gazebo"] == {"enable_ros_network": not competition}


def test_default_arm_parameters_are_those_of_original_controller() -> None:
    arm = arm_parameters(ArmSettings())
    assert arm["type"] == "effort_controllers/JointTrajectoryController"
    assert arm["joints"] == [*JOINTS]
    assert arm["state_publish_rate"] == 25
    assert arm["action_monitor_rate"] == 10
    assert arm["stop_trajectory_duration"] == 0.5
    constraints = arm["constraints"]
    assert constraints.pop("goal_time") == 0.6
    assert constraints.pop("stopped_velocity_tolerance") == 0.05
    assert constraints == {name: {"trajectory": 0.1, "goal": 0.1} for name in JOINTS}
    gains = {name: tuple(each[key] for key in ("p", "d", "i", "i_clamp")) for name, each in arm["gains"].items()}
    assert gains == {
        "linear_arm_actuator_joint": (10000, 500, 0, 1),
        "shoulder_pan_joint": (10000, 150, 0, 1),
        "shoulder_lift_joint": (50000, 150, 10, 50),
        "elbow_joint": (50000, 150, 1, 25),
        "wrist_1_joint": (100, 5, 0, 1),
        "wrist_2_joint": (75, 2, 0, 1),
        "wrist_3_joint": (25, 1, 0, 1),
    }


def test_joint_state_controller_has_rate_and_gripper_joint() -> None:
    found: Any = parameters(ARM_ONLY, competition=True)
    controller = found["ariac"]["joint_state_controller"]
    assert controller["publish_rate"] == 50
    assert controller["extra_joints"] == [
        {"name": "vacuum_gripper_joint", "position": 0.0, "velocity": 0.0, "effort": 0.0}
    ]


def test_arm_settings_of_trial_are_parameters() -> None:
    arm = arm_parameters(
        ArmSettings(
            gains={"elbow_joint": JointGains(1, 2, 3, 4)},
            tolerances={"elbow_joint": JointTolerance(0.2, 0.3)},
            goal_time=1.5,
            stop_trajectory_duration=0.25,
            allow_partial_joints_goal=True,
        )
    )
    assert arm["gains"]["elbow_joint"] == {"p": 1.0, "d": 2.0, "i": 3.0, "i_clamp": 4.0}
    assert arm["constraints"]["elbow_joint"] == {"trajectory": 0.2, "goal": 0.3}
    assert arm["constraints"]["goal_time"] == 1.5
    assert arm["stop_trajectory_duration"] == 0.25
    assert arm["allow_partial_joints_goal"] is True


def test_cell_without_arm_has_no_controller_parameters() -> None:
    found: Any = parameters(BARE, competition=True)
    assert found["ariac"].keys() == {"robot_description"}


def test_parameters_survive_xml_rpc_round_trip() -> None:
    """It uses XML-RPC, which has no None and no tuples."""
    found = parameters(WHOLE, competition=True)
    ((received,), _) = xmlrpc.client.loads(xmlrpc.client.dumps((found,)))
    assert received == found


def test_robot_of_a_cell_has_a_description_of_its_own_with_the_names_of_its_topics_and_frames(tmp_path: Path) -> None:
    trial = tandem_cell(BESIDE_ARM)
    (robot,), config = trial.layout.robots, trial.robot_models["tandem"].robot
    found: Any = parameters(trial, competition=True)
    path = tmp_path / "tandem.urdf"
    path.write_text(found["left"]["robot_description"])
    read = read_urdf(path, warn=print)
    assert [joint.name for joint in read.driven] == [joint.name for joint in config.driven]
    assert {joint.mimic.joint for joint in read.driven if joint.mimic} <= {joint.name for joint in read.driven}
    positions = {joint.name: 0.1 for joint in config.driven}
    expected, poses = link_poses(config, positions, robot.pose), link_poses(read, positions)
    assert poses.keys() == {"world", *(f"tandem_{link}" for link in config.links)}
    for link, pose in expected.items():
        assert poses[f"tandem_{link}"].position == pytest.approx(pose.position, abs=1e-9), link
    assert "tandem" not in found["robot_description"]


def test_robot_whose_trunk_is_fixed_begins_its_description_with_its_root() -> None:
    trial = tandem_cell(BESIDE_ARM)
    config = replace(trial.robot_models["tandem"], fixed_link="torso")
    text = own_description(trial.layout.robots[0], config)
    assert '"world"' not in text
    assert 'name="tandem_base"' in text
