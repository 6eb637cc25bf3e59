"""Tests of the table of a robot, for people and for programs, and of its refusals."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.cli.robot import read_pose
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.robots import bundled, load_robot
from cellwright.util.errors import UsageError
from tests.cli.conftest import CommandLine
from tests.config.robot.small_robot import CONFIG, INDICES, write


@pytest.fixture
def small(tmp_path: Path) -> str:
    return write(tmp_path, CONFIG).name


def listed(cellwright: CommandLine, *arguments: str) -> dict[str, Any]:
    ran = cellwright("robot", *arguments, "--json")
    assert (ran.status, ran.err) == (0, "")

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    return dict(json.loads(ran.out, parse_constant=refuse))


def refusal(ran: Any) -> str:
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith("error: ")
    assert ran.err.count("\n") == 1
    return str(ran.err).removeprefix("error: ").rstrip("\n")


def test_json_lists_all_joints_by_index(cellwright: CommandLine, small: str) -> None:
    found = listed(cellwright, small)
    assert [(joint["index"], joint["name"]) for joint in found["joints"]] == list(enumerate(INDICES))
    assert found["joints"][7] == {
        "index": 7,
        "name": "l2",
        "type": "revolute",
        "link": "l_lower",
        "parent": "l_upper",
        "parent_index": 6,
        "lower": 0.0,
        "upper": 2.5,
        "effort": 10.0,
        "velocity": 2.0,
        "axis": [0.0, 1.0, 0.0],
        "mimic": None,
        "groups": ["arms[1]"],
        "home": 0.2,
        "max_acceleration": None,
    }
    assert found["joints"][10]["mimic"] == {"joint": "l_finger", "multiplier": -1.0, "offset": 0.0}
    assert found["joints"][0]["parent_index"] == -1


def test_json_has_null_for_absent_limits(cellwright: CommandLine, small: str) -> None:
    joints = {joint["name"]: joint for joint in listed(cellwright, small)["joints"]}
    figures = ("lower", "upper", "effort", "velocity", "axis")
    assert [joints["spin"][name] for name in figures] == [None, None, 10.0, 2.0, [0.0, 1.0, 0.0]]
    assert [joints["r_wrist"][name] for name in figures] == [0.0, -1.0, 0.0, 0.0, [0.0, 0.0, 0.0]]


def test_link_frames_have_root_link_at_origin(cellwright: CommandLine, small: str) -> None:
    links = listed(cellwright, small)["links"]
    assert links["base"] == [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    assert links["r_hand"] == [pytest.approx([0.6, -0.2, 0.5]), [0.0, 0.0, 0.0, 1.0]]


def test_link_frames_follow_a_posture(cellwright: CommandLine, small: str) -> None:
    pose = json.dumps({"lift": 0.1, "r1": -math.pi / 2, "l_finger": 0.03})
    links = listed(cellwright, small, "--pose", pose)["links"]
    position, quaternion = links["r_hand"]
    assert position == pytest.approx([0.0, -0.2, 1.2])
    assert quaternion == pytest.approx([0.0, -math.sqrt(0.5), 0.0, math.sqrt(0.5)])
    assert links["l_other_jaw"][0] == pytest.approx([0.6, 0.2 - 0.01 - 0.03, 0.6])


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (
            "{",
            "--pose: invalid JSON (Expecting property name enclosed in double quotes, at character 2); give positions",
        ),
        ("[1]", "--pose: must be a JSON object; give positions by joint, such as '{\"elbow\": 1.57}'"),
        ('{"lft": 1}', "--pose: unknown joint 'lft'; did you mean lift (known: lift, r1, r2, "),
        ('{"r_wrist": 1}', "--pose: r_wrist is fixed, and has no position (known: lift, r1, r2, "),
        ('{"r1": NaN}', "--pose: r1: must be a finite number [rad; m] (got NaN"),
        ('{"r1": true}', "--pose: r1: must be a finite number [rad; m] (got true"),
        ('{"r1": "1"}', '--pose: r1: must be a finite number [rad; m] (got "1"'),
        ('{"r1": 1e300}', "--pose: r1: must be a finite number [rad; m] (got 1e+300"),
        ("[" * 100_000, "--pose: invalid JSON (no JSON); give positions"),
        (f'{{"r1": {"9" * 5000}}}', "--pose: invalid JSON (no JSON); give positions"),
    ],
)
def test_invalid_pose_is_refused(pose: str, message: str, cellwright: CommandLine, small: str) -> None:
    assert refusal(cellwright("robot", small, "--json", "--pose", pose)).startswith(message)


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_robot("tandem", lambda _line: None).robot


@pytest.mark.slow
@given(st.text(max_size=30) | st.recursive(st.none() | st.floats() | st.just("r1"), st.lists).map(json.dumps))
@settings(max_examples=50)
def test_random_text_as_pose_is_accepted_or_refused(model: RobotModel, text: str) -> None:
    with pytest.raises(UsageError, match="--pose: "):
        read_pose(text, model)


def test_table_lists_joints_and_notes(cellwright: CommandLine, small: str) -> None:
    ran = cellwright("robot", small)
    lines = ran.out.splitlines()
    assert (ran.status, ran.err) == (0, "")
    assert lines[0] == "Small: 14 joints: 10 commanded, 2 mimic, 2 fixed; root link base (-1)"
    assert [line.split()[1] for line in lines[4:18]] == list(INDICES)
    assert lines[6].split() == ["2", "r2", "revolute", "r_lower", "1", "0", "2.5", "10", "2", "arm", "R", "0.2"]
    assert lines[7].split() == ["3", "r_wrist", "fixed", "r_hand", "2"]
    assert lines[9].split()[-4:] == ["2", "gripper", "R,", "mimic"]
    assert lines[17].split() == ["13", "spin", "continuous", "wheel", "-1", "-", "-", "10", "2", "waist", "0.5"]
    assert "arm R       tip r_hand; poses in the frame of torso" in lines
    assert "mimic       r_thumb = -1 * r_finger" in lines
    assert "not used    vibration_thresholds (thresholds for the vibration of the operator's controllers)" in lines
    assert max(map(len, lines[:18])) < 100


def test_command_without_robot_lists_bundled_robots(cellwright: CommandLine) -> None:
    ran = cellwright("robot")
    assert (ran.status, ran.err) == (0, "")
    assert all(name in ran.out for name in bundled())
    found = listed(cellwright)["robots"]
    assert [robot["name"] for robot in found] == bundled()
    assert {robot["name"]: robot["joints"] for robot in found}["qinglong"] == 95


def test_warnings_go_to_stderr_and_not_into_table(cellwright: CommandLine, small: str, tmp_path: Path) -> None:
    (tmp_path / small).write_text(CONFIG + "arm: []\n")
    ran = cellwright("robot", small, "--json")
    assert ran.err == "warning: vr_configs.yml:16: arm: unknown entry, ignored; did you mean arms\n"
    assert json.loads(ran.out)["not_used"] == ["vibration_thresholds"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("no.yml",), "no.yml: there is no such file"),
        (("qinglnog",), "unknown robot 'qinglnog'; did you mean qinglong (known: "),
        (("--pose", "{}"), "--pose requires a robot"),
        (("qinglong", "--pose", "{}"), "--pose requires --json"),
        (("broken.yml",), "broken.yml:1: urdf_path: there is no file no.urdf in "),
    ],
)
def test_invalid_options_are_refused(
    arguments: tuple[str, ...], message: str, cellwright: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "broken.yml").write_text("urdf_path: no.urdf\n")
    assert refusal(cellwright("robot", *arguments)).startswith(message)


def test_check_accepts_robot_configurations(cellwright: CommandLine, small: str, tmp_path: Path) -> None:
    for name in (small, "robot.urdf", str(tmp_path), "qinglong"):
        ran = cellwright("check", name)
        assert (ran.status, ran.out, ran.err) == (0, "ok\n", "")
    assert json.loads(cellwright("check", small, "--json").out)["resolved"]["name"] == "Small"


def test_check_reports_every_error_of_a_robot_configuration(
    cellwright: CommandLine, small: str, tmp_path: Path
) -> None:
    (tmp_path / small).write_text(CONFIG.replace("[6, 7]", "[6, 8]") + "arm: []\n")
    ran = cellwright("check", small)
    assert (ran.status, ran.err) == (2, "")
    error, warning, verdict = ran.out.splitlines()
    assert error.startswith("error: vr_configs.yml:7: arms[1].joint_index[1]: joint 8 (l_wrist) is fixed")
    assert warning == "warning: vr_configs.yml:16: arm: unknown entry, ignored; did you mean arms"
    assert verdict == "1 error"


def test_init_writes_draft_configuration(cellwright: CommandLine, small: str, tmp_path: Path) -> None:
    (tmp_path / "new").mkdir()
    ran = cellwright("robot", "robot.urdf", "--init", "new/vr_configs.yml")
    assert (ran.status, ran.err) == (0, "")
    assert ran.out.endswith("all guessed; review the file, then run: cellwright check new/vr_configs.yml\n")
    assert cellwright("check", "new").out == "ok\n"
    assert "urdf_path: ../robot.urdf" in (tmp_path / "new" / "vr_configs.yml").read_text()
    again = cellwright("robot", "robot.urdf", "--init", "new/vr_configs.yml")
    assert refusal(again) == "--init new/vr_configs.yml: file exists; choose another name, or remove it"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--init", "no/a.yml"), "--init no/a.yml: there is no folder no"),
        (("--init", "a.json"), "--init a.json: give a file such as vr_configs.yml, and no --json"),
        (("--init", "a.yml", "--json"), "--init a.yml: give a file such as vr_configs.yml, and no --json"),
        (("--init", "."), "--init .: give a file such as vr_configs.yml"),
    ],
)
def test_init_with_unusable_file_is_refused(arguments: tuple[str, ...], message: str, cellwright: CommandLine) -> None:
    assert refusal(cellwright("robot", "tandem", *arguments)).startswith(message)


XACRO = '<robot name="r"><link name="$(arg side)_arm"/></robot>'


def test_arguments_of_xacro_file_are_given_by_name(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(XACRO)
    assert list(listed(cellwright, "arm.xacro", "side:=left")["links"]) == ["left_arm"]
    assert cellwright("check", "arm.xacro", "side:=left").out == "ok\n"
    assert "the argument 'side' has no value; give one as side:=VALUE" in refusal(cellwright("robot", "arm.xacro"))
    message = "side=left: give arguments of a xacro file as NAME:=VALUE"
    assert refusal(cellwright("robot", "arm.xacro", "side=left")) == message


def test_draft_of_configuration_keeps_arguments(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(XACRO)
    assert cellwright("robot", "arm.xacro", "side:=007", "--init", "vr_configs.yml").status == 0
    assert load_robot(tmp_path / "vr_configs.yml", print).robot.root == "007_arm"
