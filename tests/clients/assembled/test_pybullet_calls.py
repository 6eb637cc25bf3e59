"""Calls of PyBullet about an assembled robot: three answer, the others say what to use."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.robot import AssembledRobot
from cellwright.util.errors import UsageError
from tests.clients.assembled.robots import JOINTS, configs, write_urdf

CALLS = ("getNumJoints", "getJointInfo", "getJointState")


@pytest.fixture(scope="module")
def bullet() -> Iterator[Any]:
    """PyBullet with a client that has no bodies, as a program begins."""
    module = pytest.importorskip("pybullet", reason="PyBullet is not installed")
    originals = {name: getattr(module, name) for name in CALLS}
    client = module.connect(module.DIRECT)
    yield module
    module.disconnect(client)
    for name, original in originals.items():
        setattr(module, name, original)


@pytest.fixture(scope="module")
def robot(bullet: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssembledRobot]:
    assert bullet.isConnected()
    made = AssembledRobot(write_urdf(tmp_path_factory.mktemp("robot")), configs())
    yield made
    made.close()


def test_loop_of_the_original_reads_joints_that_are_not_fixed(bullet: Any, robot: AssembledRobot) -> None:
    robot.reset_j(robot.joint_name2id_dict["lift"], 0.25)
    found = {}
    for i in range(bullet.getNumJoints(robot.robot_id)):
        info = bullet.getJointInfo(robot.robot_id, i)
        if info[2] != bullet.JOINT_FIXED:
            found[info[1].decode("utf-8")] = bullet.getJointState(robot.robot_id, i)[0]
    assert list(found) == [name for name, kind, *_ in JOINTS if kind != "fixed"]
    assert found["lift"] == pytest.approx(0.25)


def test_description_of_a_joint_has_pybullets_entries(bullet: Any, robot: AssembledRobot) -> None:
    shoulder = bullet.getJointInfo(bodyUniqueId=robot.robot_id, jointIndex=1)
    assert (len(shoulder), shoulder[:3]) == (17, (1, b"shoulder", bullet.JOINT_REVOLUTE))
    assert shoulder[8:13] == (-2.0, 2.0, 100.0, 3.0, b"shoulder_link")
    assert [bullet.getJointInfo(robot.robot_id, i)[16] for i in range(7)] == [-1, 0, 1, 2, 2, 0, 5]
    assert bullet.getJointState(robot.robot_id, 2) == (0.0, 0.0, None, 0.0)


def test_other_calls_about_the_robot_say_what_to_use(bullet: Any, robot: AssembledRobot) -> None:
    calls: tuple[Callable[[], object], ...] = (
        lambda: bullet.getLinkState(robot.robot_id, 0),
        lambda: bullet.resetJointState(robot.robot_id, 0, 0.1),
        lambda: bullet.setJointMotorControl2(robot.robot_id, 0, bullet.POSITION_CONTROL, 0.1),
    )
    for call in calls:
        with pytest.raises(UsageError, match=r"not in PyBullet.*use self\.joint_states\(\), self\.link_pose"):
            call()
    with pytest.raises(UsageError, match="joint index 7: must be from 0 to 6"):
        bullet.getJointState(robot.robot_id, 7)


def test_bodies_of_pybullet_are_answered_by_pybullet(bullet: Any, robot: AssembledRobot, tmp_path: Path) -> None:
    assert robot.is_running
    body = bullet.loadURDF(str(write_urdf(tmp_path)), useFixedBase=True)
    assert bullet.getNumJoints(body) == len(JOINTS)
    assert bullet.getJointInfo(body, 1)[1] == b"shoulder"
    assert bullet.getJointState(body, 1)[0] == 0.0
