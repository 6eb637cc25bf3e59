"""Services of a robot beside its topics: requests of clients, and refusals."""

from typing import Any

import numpy as np
import pytest

from cellwright.robot.node import RobotNode
from cellwright.robot.services import RobotServices
from cellwright.util.errors import CellwrightError, RejectedCommandError
from cellwright.util.pose import Pose
from tests.robot.robots import two_arms


@pytest.fixture(scope="module")
def node() -> RobotNode:
    return RobotNode(two_arms())


@pytest.fixture
def services(node: RobotNode) -> RobotServices:
    node.simulation.reset()
    return RobotServices(node)


def test_state_service_returns_all_joints_by_index(node: RobotNode, services: RobotServices) -> None:
    state = services.state({})
    movable = [joint.name for joint in node.config.robot.movable]
    assert state["positions"][movable.index("shoulder_right")] == 0.5
    assert state["positions"][movable.index("antenna")] == 0.0  # a ball joint has no single position
    assert state["driven"] == node.driver.read().positions.tolist()
    assert state["targets"] == node.commander.applied.tolist()
    assert state["carrier"] == [0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0]
    assert "links" in state


def test_state_and_describe_do_not_change_state(node: RobotNode, services: RobotServices) -> None:
    before = node.simulation.state_hash()
    services.state({"links": [-1, 0, 1]})
    services.describe({})
    assert node.simulation.state_hash() == before


def test_state_service_returns_links_in_frame_of_another(node: RobotNode, services: RobotServices) -> None:
    tip = node.config.robot.link_indices["tip_right"]
    ((at, turn),) = services.state({"links": [tip], "frame": -1})["links"]
    poses = [Pose(at, (w, x, y, z)) for at, (x, y, z, w) in services.state({"links": [-1, tip]})["links"]]
    root_T_tip = poses[0].inverse() @ poses[1]
    w, x, y, z = root_T_tip.quaternion
    assert at == pytest.approx(root_T_tip.position)
    assert turn == pytest.approx([x, y, z, w])
    with pytest.raises(CellwrightError, match="no link with the index 'root'"):
        services.state({"links": [tip], "frame": "root"})


def test_move_and_place_set_joint_positions(node: RobotNode, services: RobotServices) -> None:
    lift = node.config.robot.joint_indices["lift"]
    services.place({"joints": [lift], "positions": [0.2]})
    number = node.commander.numbers["lift"]
    assert node.driver.read().positions[number] == 0.2
    services.move({"joints": [lift], "positions": [0.25]})
    for _ in range(240):
        node.simulation.step()
    assert node.driver.read().positions[number] == pytest.approx(0.25, abs=1e-4)


def test_move_tip_reaches_pose_and_other_arm_continues(node: RobotNode, services: RobotServices) -> None:
    robot = node.config.robot
    arm = [robot.joint_indices[name] for name in node.config.arms[0].joints]
    tip, elbow = robot.link_indices["tip_right"], robot.joint_indices["elbow_left"]
    services.place({"joints": arm, "positions": [0.6, -0.9, 0.1]})
    (goal,) = services.state({"links": [tip]})["links"]
    services.place({"joints": arm, "positions": [0.5, -1.0, 0.2]})
    services.move({"joints": [elbow], "positions": [-0.3]})
    services.move_tip({"arm": 0, "pose": goal})
    for _ in range(480):
        node.simulation.step()
    np.testing.assert_allclose(services.state({"links": [tip]})["links"][0][0], goal[0], atol=1e-3)
    assert node.driver.read().positions[node.commander.numbers["elbow_left"]] == pytest.approx(-0.3, abs=1e-3)


def test_move_tip_of_unknown_arm_is_refused(services: RobotServices) -> None:
    for arm in (None, -1, 2, "right"):
        with pytest.raises(CellwrightError, match="unknown arm"):
            services.move_tip({"arm": arm, "pose": [[0, 0, 0], [0, 0, 0, 1]]})


def test_stopped_robot_refuses_motion_services(node: RobotNode, services: RobotServices) -> None:
    node.commander.stop("a user pressed the button")
    before = node.driver.read().positions.copy()
    for service in (services.move, services.place):
        with pytest.raises(CellwrightError, match="takes no commands now: a user pressed the button"):
            service({"joints": [1], "positions": [0.5]})
    with pytest.raises(CellwrightError, match="takes no commands now: a user pressed the button"):
        services.place_base({"pose": [[1, 0, 0], [0, 0, 0, 1]]})
    np.testing.assert_array_equal(node.driver.read().positions, before)
    assert services.state({})["carrier"][0] == 0.0


@pytest.mark.parametrize(
    "payload",
    [
        {},
        {"joints": 1, "positions": 0.0},
        {"joints": [1, 2], "positions": [0.0]},
        {"joints": [999], "positions": [0.0]},
        {"joints": ["lift"], "positions": [0.0]},
        {"joints": [[1]], "positions": [0.0]},
        {"joints": [1], "positions": [float("nan")]},
        {"joints": [1], "positions": ["0"]},
        {"joints": [1], "positions": [None]},
        {"joints": [1] * 5000, "positions": [0.0] * 5000},
    ],
)
def test_invalid_joint_request_is_refused(services: RobotServices, payload: dict[str, Any]) -> None:
    for service in (services.move, services.place):
        with pytest.raises(CellwrightError):
            service(payload)


@pytest.mark.parametrize("pose", [None, [], [[0, 0, 0]], [[0, 0, 0], [0, 0, 0, 0]], [["a", 0, 0], [0, 0, 0, 1]], "x"])
def test_invalid_pose_request_is_refused(services: RobotServices, pose: Any) -> None:
    with pytest.raises(CellwrightError, match="pose must be"):
        services.place_base({"pose": pose})
    with pytest.raises(CellwrightError):
        services.state({"links": [1e9]})


@pytest.mark.parametrize("links", [[0] * 5000, {"0": 1}, 7, None])
def test_invalid_or_long_list_of_links_is_refused(services: RobotServices, links: Any) -> None:
    with pytest.raises(RejectedCommandError, match="a list of at most 4096 indices"):
        services.state({"links": links})
