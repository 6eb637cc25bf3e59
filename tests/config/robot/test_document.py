"""Robot as data for programs."""

import json
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.groups import robot_document
from cellwright.config.robot.model import link_poses
from cellwright.config.robot.robots import load_robot
from cellwright.util.pose import Pose
from tests.config.robot.small_robot import write


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> RobotConfig:
    return load_robot(write(tmp_path_factory.mktemp("small")), lambda _line: None)


def test_document_groups_match_file_by_name(small: RobotConfig) -> None:
    groups = robot_document(small)["groups"]
    assert groups["arms"][0] == {
        "joints": ["r1", "r2"],
        "tip": "r_hand",
        "home": [0.1, 0.2],
        "command_link": "r_hand",
        "reference_link": "torso",
    }
    assert groups["arms"][1]["reference_link"] == "base"
    assert groups["grippers"] == [
        {"joints": ["r_finger", "r_thumb"], "open": ["lower", "lower"]},
        {"joints": ["l_finger", "l_thumb"], "open": ["lower", "lower"]},
    ]
    assert groups["head"] == {"joints": ["head_pitch", "head_yaw"], "home": [0.3, 0.0], "axes": ["pitch", "yaw"]}
    assert (groups["waist"], groups["dorsal"]) == (
        {"joints": ["spin"], "home": [0.5]},
        {"joints": ["lift"], "home": [0.25]},
    )


def test_document_is_plain_json(small: RobotConfig) -> None:
    found = json.loads(json.dumps(robot_document(small), allow_nan=False))
    assert found["base_pose"] == [[0, 0, 0.9], [0, 0, math.sqrt(0.5), math.sqrt(0.5)]]
    assert (found["name"], found["root"], found["fixed_link"]) == ("Small", "base", None)
    assert found["home"] == small.home
    assert found["not_used"] == ["vibration_thresholds"]


def test_document_of_plain_urdf_has_no_groups(small: RobotConfig) -> None:
    found = robot_document(load_robot(small.urdf_path, lambda _line: None))
    assert found["groups"] == {"arms": [], "grippers": [], "head": None, "waist": None, "dorsal": None}
    assert [joint["groups"] for joint in found["joints"]] == [[]] * 14


@given(st.dictionaries(st.sampled_from(["lift", "r1", "l2", "spin", "head_yaw"]), st.floats(-3, 3)))
@settings(max_examples=25)
def test_document_links_are_at_posture(small: RobotConfig, positions: dict[str, float]) -> None:
    links: dict[str, Any] = robot_document(small, positions)["links"]
    poses = link_poses(small.robot, positions)
    assert list(links) == list(poses)
    for name, (position, (x, y, z, w)) in links.items():
        assert Pose(tuple(position), (w, x, y, z)) == poses[name]
