"""The base class of controller nodes: the names of the io_teleop stack, and a moving robot."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.robot import AssembledRobot
from cellwright.util.errors import CellwrightError, UnknownNameError, UsageError
from tests.clients.assembled.robots import configs, write_urdf
from tests.support.waiting import TIMEOUT, wait_until


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_urdf(tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="module")
def shared(urdf: Path) -> Iterator[AssembledRobot]:
    robot = AssembledRobot(urdf, configs())
    yield robot
    robot.close()


@pytest.fixture
def robot(shared: AssembledRobot) -> AssembledRobot:
    """The robot in its initial state."""
    shared.base.reset_base([[0, 0, 0.2], [0, 0, 0.7071068, 0.7071068]])
    shared.reset_j([0, 1, 3, 4, 5, 6], [0, 0.5, 0, 0, 0, 0])
    return shared


def wait_for_joints(robot: AssembledRobot, condition: Callable[[], object]) -> None:
    """Wait until the joints meet a condition."""
    wait_until(condition, "end of the motion", seen=lambda: robot.joint_states().positions)


def test_joint_and_link_names_map_to_indices(robot: AssembledRobot) -> None:
    names = ["lift", "shoulder", "tip", "finger", "thumb", "neck", "nod"]
    assert robot.joint_name2id_dict == {name: index for index, name in enumerate(names)}
    assert robot.joint_id2name_dict == dict(enumerate(names))
    assert robot.link_name2id_dict == {f"{name}_link": index for index, name in enumerate(names)}
    states = robot.joint_states()
    assert states.names == [name for name in names if name != "tip"]
    assert states.positions == pytest.approx([0, 0.5, 0, 0, 0, 0], abs=1e-6)
    assert len(states.velocities) == len(states.efforts) == 6


def test_parts_match_configuration(robot: AssembledRobot) -> None:
    (arm,) = robot.arms
    assert (arm.arm_joint_index, arm.ee_index, arm.home_j_pos) == ([1], 2, [0.5])
    assert robot.grippers[0].finger_index == [3, 4]
    assert robot.grippers[0].joint_range == [[0.0, 0.04], [0.0, 0.02]]
    assert robot.head.head_joint_index == [6, 5]
    assert robot.dorsal.dorsal_lift_joint_index == 0


def test_joints_move_to_targets_and_stop_at_limits(robot: AssembledRobot) -> None:
    robot.move_j([1, 0], [-0.5, 0.2], [1.0], [5.0])
    wait_for_joints(
        robot, lambda: abs(robot.arms[0].joint_pos[0] + 0.5) < 1e-3 and abs(robot.dorsal.height - 0.2) < 1e-3
    )
    robot.move_j(1, np.float64(9.0))  # one joint needs no list; it stops at its limit
    wait_for_joints(robot, lambda: abs(robot.arms[0].joint_pos[0] - 2.0) < 1e-3)
    robot.reset_j(np.array([1]), np.array([0.25]))
    assert robot.arms[0].joint_pos == pytest.approx([0.25])


def test_gripper_closes_and_opens_by_status(robot: AssembledRobot) -> None:
    (gripper,) = robot.grippers
    assert gripper.joint_pos_from_status(0.5) == [0.02, 0.01]
    gripper.move(1.7)
    wait_for_joints(robot, lambda: gripper.status > 0.999)
    assert gripper.joint_pos == pytest.approx([0.04, 0.02], abs=1e-4)
    gripper.reset(0.25)
    assert gripper.status == pytest.approx(0.25)


def test_head_and_lift_move_and_return_home(robot: AssembledRobot) -> None:
    def is_at(rotation: list[float], height: float) -> bool:
        return bool(np.allclose([*robot.head.rotation, robot.dorsal.height], [*rotation, height], atol=1e-3))

    robot.head.move([9.0, 0.3, -0.4])  # it cannot roll
    robot.dorsal.move(0.3)
    wait_for_joints(robot, lambda: is_at([0.0, 0.3, -0.4], 0.3))
    robot.reset_home()
    wait_for_joints(robot, lambda: is_at([0.0, 0.1, 0.2], 0.1))


def test_tip_poses_match_hand_calculation(robot: AssembledRobot) -> None:
    """Worked out by hand: the robot faces y, and its arm hangs by 0.5 rad."""
    c, s = np.cos(0.5), np.sin(0.5)
    (x, y, z), turn = robot.arms[0].abs_ee_pose
    assert (x, y, z) == pytest.approx((0.0, 0.1 + 0.3 * c, 0.2 + 0.5 - 0.3 * s), abs=1e-6)
    position, orientation = robot.arms[0].rel_ee_pose
    assert position == pytest.approx([0.1 + 0.3 * c, 0.0, 0.5 - 0.3 * s], abs=1e-6)
    assert orientation == pytest.approx([0.0, np.sin(0.25), 0.0, np.cos(0.25)], abs=1e-6)
    assert np.linalg.norm(turn) == pytest.approx(1.0)
    assert robot.arms[0].home_ee_pose[0] == pytest.approx((x, y, z), abs=1e-6)


def test_tip_moves_to_pose_until_next_command(robot: AssembledRobot) -> None:
    """One joint turns it, on a circle about the shoulder."""
    c, s = np.cos(0.8), np.sin(0.8)
    half = [np.sin(0.4), np.cos(0.4)]
    quarter = np.sqrt(0.5)
    turn = [-quarter * half[0], quarter * half[0], quarter * half[1], quarter * half[1]]
    robot.arms[0].move_ee(((0.0, 0.1 + 0.3 * c, 0.7 - 0.3 * s), turn))
    wait_for_joints(robot, lambda: abs(robot.arms[0].joint_pos[0] - 0.8) < 0.01)
    robot.move_j([1], [0.2])  # a later command ends it
    wait_for_joints(robot, lambda: abs(robot.arms[0].joint_pos[0] - 0.2) < 0.01)


def test_base_is_set_to_pose_and_refuses_invalid_ones(robot: AssembledRobot) -> None:
    assert robot.base.pose[0] == pytest.approx([0, 0, 0.2])
    robot.base.reset_base(((1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 2.0)))  # not quite a unit quaternion
    assert robot.base.pose[0] == pytest.approx([1.0, 2.0, 0.0])
    assert robot.base.pose[1] == pytest.approx([0.0, 0.0, 0.0, 1.0])
    assert robot.link_pose(0)[0] == pytest.approx([1.0, 2.0, 0.5])
    wrong: Any
    for wrong in ([[0, 0, 0], [0, 0, 0, 0]], [[0, 0, float("nan")], [0, 0, 0, 1]], [[0, 0], [0, 0, 0, 1]]):
        with pytest.raises(CellwrightError, match=r"a pose (is|must be)"):
            robot.base.reset_base(wrong)


@pytest.mark.parametrize(
    ("indices", "positions", "reason"),
    [
        ([7], [0.0], "joint index 7: must be from 0 to 6"),
        ([-1], [0.0], "joint index -1"),
        (["lift"], [0.0], "joint index 'lift'"),
        ([2], [0.0], "joint 2, tip, cannot move: its type is fixed"),
        ([1], [float("nan")], "finite"),
        ([0, 1], [0.1], "must have the same length .got 2 and 1"),
    ],
)
def test_invalid_joint_command_is_refused_without_motion(
    robot: AssembledRobot, indices: Any, positions: Any, reason: str
) -> None:
    for command in (robot.move_j, robot.reset_j):
        with pytest.raises(UsageError, match=reason):
            command(indices, positions)
    assert robot.arms[0].joint_pos == pytest.approx([0.5], abs=1e-6)


def test_unknown_joint_or_link_is_refused(robot: AssembledRobot) -> None:
    with pytest.raises(UnknownNameError, match="unknown joint 'shoulde'; did you mean shoulder"):
        robot.joint_name2id_dict["shoulde"]
    with pytest.raises(KeyError):
        robot.link_name2id_dict["base"]  # the root has no joint above it
    assert "shoulde" not in robot.joint_name2id_dict
    with pytest.raises(CellwrightError, match="no link with the index 99"):
        robot.link_pose(99)


def test_robot_serves_many_threads(robot: AssembledRobot) -> None:
    errors: list[BaseException] = []

    def work(joint: int) -> None:
        try:
            for number in range(50):
                robot.move_j([joint], [0.001 * number])
                assert len(robot.joint_states().names) == 6
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work, args=(joint,)) for joint in (0, 1, 3, 5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT)
    assert errors == []
    wait_for_joints(robot, lambda: abs(robot.arms[0].joint_pos[0] - 0.049) < 1e-3)


@pytest.mark.parametrize(
    ("attribute", "entry", "has_window"),
    [(None, {}, False), (None, {"without_gui": False}, True), (True, {"without_gui": False}, False), (False, {}, True)],
)
def test_window_is_requested_by_attribute_or_configuration(
    urdf: Path, monkeypatch: pytest.MonkeyPatch, attribute: bool | None, entry: dict[str, Any], has_window: bool
) -> None:
    class Seen(AssembledRobot):
        without_gui = attribute

    def refuse(_python: str, order: dict[str, Any]) -> None:
        raise UsageError(f"window: {order['window']}")

    monkeypatch.setattr("cellwright.clients.assembled.robot.RobotProcess", refuse)
    with pytest.raises(UsageError, match=f"window: {has_window}"):
        Seen(urdf, {**configs(), **entry})


@pytest.mark.slow
def test_client_of_node_connects_to_robot_address(robot: AssembledRobot) -> None:
    transport = SocketTransport(robot.address)
    assert "/io_teleop/joint_cmd" in {topic["name"] for topic in transport.welcome["topics"]}
    transport.close()
    assert robot.is_running  # a client that leaves is not its owner


@pytest.mark.slow
def test_invalid_configuration_is_refused_with_place(urdf: Path) -> None:
    with pytest.raises(UsageError) as caught:
        AssembledRobot(urdf, {**configs(), "arms": [{"joint_index": [99], "ee_index": 2, "rest_j_pos": [0.5]}]})
    assert "configs: arms" in str(caught.value)
    assert "99" in str(caught.value)
    assert "configs.yml" not in str(caught.value)


@pytest.mark.slow
def test_robot_without_parts_in_debug_prints_index_table(
    urdf: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    bare = AssembledRobot(urdf, {}, True, True, 3)
    assert not any(hasattr(bare, name) for name in ("grippers", "head", "dorsal", "cameras"))
    assert (bare.arms, bare.with_ee_constraint, bare.physics_clent_id) == ([], True, 3)
    bare.reset_home()
    bare.close()
    captured = capfd.readouterr()
    rows = [line.split() for line in captured.out.splitlines()]
    assert ["1", "shoulder", "revolute", "shoulder_link", "lift_link", "-2", "2"] in rows
    assert ["2", "tip", "fixed", "tip_link", "shoulder_link"] in rows
    assert "window cannot open" in captured.err


@pytest.mark.slow
def test_gripper_status_with_opposite_mimic_joint_is_exact(urdf: Path, tmp_path: Path) -> None:
    text = urdf.read_text()
    at = text.index("/>", text.index("<limit", text.index('name="thumb"'))) + 2
    assert 'lower="0.0" upper="0.02"' in text[at - 80 : at]
    thumb = text[:at].replace('lower="0.0" upper="0.02"', 'lower="-0.04" upper="0"')
    (tmp_path / "small.urdf").write_text(f'{thumb}<mimic joint="finger" multiplier="-1"/>{text[at:]}')
    robot = AssembledRobot(tmp_path / "small.urdf", configs())
    (gripper,) = robot.grippers
    for status in (0.0, 0.25, 1.0):
        gripper.reset(status)
        assert gripper.joint_pos == pytest.approx([0.04 * status, -0.04 * status], abs=1e-6)
        assert gripper.status == pytest.approx(status, abs=1e-4)
    robot.move_j((index for index in (0, 1)), map(float, "12"))  # iterators without a length
    robot.close()


@pytest.mark.slow
def test_gripper_open_at_upper_limits_has_inverted_status(urdf: Path) -> None:
    robot = AssembledRobot(urdf, configs() | {"grippers": [{"joint_index": [3, 4], "open": ["upper", "lower"]}]})
    (gripper,) = robot.grippers
    assert gripper.joint_range == [[0.0, 0.04], [0.0, 0.02]]
    for status in (0.0, 0.25, 1.0):
        gripper.reset(status)
        assert gripper.joint_pos == pytest.approx([0.04 * (1 - status), 0.02 * status], abs=1e-6)
        assert gripper.status == pytest.approx(status, abs=1e-4)
    robot.close()
