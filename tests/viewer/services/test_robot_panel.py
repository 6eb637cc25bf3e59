"""Panel of a robot: correct, as JSON, and without effect on the robot's state."""

import json
import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cellwright.middleware.messages.conversions import header, joint_state, pose_message
from cellwright.middleware.messages.standard import Bool, PoseArray
from cellwright.robot.node import RobotNode
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose
from cellwright.viewer.services.robot_panel import RobotPanel
from tests.robot.robots import two_arms


@pytest.fixture(scope="module")
def shared() -> RobotNode:
    return RobotNode(two_arms(), stamp=lambda: 77)


@pytest.fixture
def node(shared: RobotNode) -> RobotNode:
    shared.simulation.reset()
    return shared


def panel_of(node: RobotNode, **request: Any) -> dict[str, Any]:
    """Panel as it arrives at a client."""
    return dict(json.loads(json.dumps(RobotPanel(node).state(request), allow_nan=False)))


def run(node: RobotNode, seconds: float) -> None:
    node.simulation.step_until(node.simulation.now + round(seconds * 1e9))


def pose(numbers: list[float]) -> Pose:
    x, y, z, *quaternion = numbers
    return Pose((x, y, z), (quaternion[0], quaternion[1], quaternion[2], quaternion[3]))


def test_panel_sends_robot_constants_once(node: RobotNode) -> None:
    first = panel_of(node)
    robot = first["robot"]
    assert [joint["name"] for joint in robot["joints"]] == list(node.driver.joints)
    joints = {joint["name"]: joint for joint in robot["joints"]}
    assert joints["lift"] == {"name": "lift", "lower": 0.0, "upper": 0.4, "unit": "m", "follows": False}
    assert joints["wheel"]["lower"] is joints["wheel"]["upper"] is None, "it turns without end"
    assert joints["thumb_left"]["follows"]
    assert [arm["name"] for arm in robot["arms"]] == ["right", "left"]
    assert robot["arms"][1]["tip"] == "tip_left"
    assert robot["grippers"] == ["right", "left"]
    assert (robot["base_mode"], robot["is_real"]) == ("original", False)
    followers = {number for number, joint in enumerate(robot["joints"]) if joint["follows"]}
    assert followers.isdisjoint(number for group in robot["groups"] for number in group["joints"])
    assert "robot" not in panel_of(node, robot=first["digest"])
    assert "robot" in panel_of(node, robot="of another")
    assert "robot" in panel_of(node, robot=[1])


def test_fixed_base_has_no_base_mode() -> None:
    fixed = replace(two_arms(), fixed_link="torso")
    assert panel_of(RobotNode(fixed))["robot"]["base_mode"] is None


def test_panel_has_positions_of_joints_and_tips(node: RobotNode) -> None:
    node.base.place(Pose.from_rpy((1.0, 2.0, 0.5), (0.0, 0.0, 0.7)))
    elbow = node.commander.numbers["elbow_right"]
    node.bus.publish("/io_teleop/joint_cmd", joint_state(["elbow_right"], [-0.5], time=0), node="/me")
    run(node, 1.0)
    found = panel_of(node)
    assert found["positions"][elbow] == pytest.approx(-0.5, abs=1e-3)
    assert found["targets"][elbow] == -0.5
    assert (found["stamp"], found["time"]) == (77, node.simulation.now)
    for tip, reference, expected in zip(found["tips"], found["references"], node.ee_poses.poses(), strict=True):
        seen = pose(reference).inverse() @ pose(tip)
        assert seen.position == pytest.approx(expected.position, abs=1e-4)
        assert abs(np.dot(seen.quaternion, expected.quaternion)) == pytest.approx(1.0, abs=2e-5)
    assert pose(found["base"]).position == (1.0, 2.0, 0.5)
    assert found["aims"] == [None, None]
    assert (found["commander"], found["taken"], found["message"]) == ("/me", 1, "follows /me")


def test_panel_has_targets_of_tips(node: RobotNode) -> None:
    right, left = node.ee_poses.poses()
    higher = Pose((0.0, 0.0, 0.05)) @ right
    node.bus.publish(
        "/io_teleop/target_ee_poses", PoseArray(header(), [*map(pose_message, (higher, left))]), node="/me"
    )
    run(node, 0.1)
    found = panel_of(node)
    assert pose(found["aims"][0]).position[2] == pytest.approx(pose(found["tips"][1]).position[2] + 0.05, abs=1e-3)


def test_panel_has_reason_for_ignored_commands(node: RobotNode) -> None:
    assert panel_of(node)["enabled"]
    node.bus.publish("/io_teleop/emergency_stop", Bool(True), node="/guard")
    run(node, 0.05)
    found = panel_of(node)
    assert found["stopped"]
    assert "emergency stop by /guard" in found["held"]
    assert "clear_emergency_stop" in found["message"]


def test_panel_counts_refusals_with_reason(node: RobotNode) -> None:
    before = panel_of(node)["refused"]
    for number in range(12):
        with suppress(RejectedCommandError):
            node.bus.publish("/io_teleop/joint_cmd", joint_state(["lift"], [math.nan], time=0), node=f"/bad{number}")
    run(node, 0.05)
    found = panel_of(node)
    assert found["refused"] == before + 12
    assert 0 < len(found["refusals"]) <= 8, "names come from outside, and are limited"


def test_unknown_joint_position_is_null(node: RobotNode, monkeypatch: pytest.MonkeyPatch) -> None:
    readings = node.driver.read()
    unknown = readings.positions.copy()
    unknown[0] = math.nan
    monkeypatch.setattr(node.servos, "read", lambda: readings._replace(positions=unknown))
    found = panel_of(node)
    assert found["positions"][0] is None
    assert None not in found["positions"][1:]


def test_panel_request_leaves_node_unchanged(node: RobotNode) -> None:
    run(node, 0.1)
    before = node.simulation.state_hash()
    panel_of(node)
    assert node.simulation.state_hash() == before
