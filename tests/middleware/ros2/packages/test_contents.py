"""Files of the ROS 2 packages: definitions as in ROS 1 but for three types, and manifests that name what is used."""

from __future__ import annotations

import ast
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cellwright
from cellwright.middleware.messages import TYPES
from cellwright.middleware.ros2.packages.contents import (
    LAUNCH,
    definitions,
    dependencies,
    in_ros2,
    interface_packages,
    package_files,
)
from cellwright.util.errors import UnknownNameError

STANDARD = {
    "action_msgs",
    "builtin_interfaces",
    "geometry_msgs",
    "lifecycle_msgs",
    "sensor_msgs",
    "std_msgs",
    "trajectory_msgs",
    "unique_identifier_msgs",
}
"""Packages of ROS 2 that ours may use: all of them are in our own environment."""

OLD = {"Header": "std_msgs/Header", "time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}

names = st.from_regex(r"[a-z][a-z0-9_]{0,9}", fullmatch=True)
array = st.sampled_from(["", "[]", "[3]"])
modern_types = st.sampled_from(
    ["bool", "float64", "string", "geometry_msgs/Pose", "Kit", "Headers", "timer", "std_msgs/Header"]
)
comments = st.text(st.characters(exclude_characters="\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029", codec="utf-8"), max_size=20)
modern_lines = st.one_of(
    st.just(""),
    st.just("---"),
    comments.map("# {}".format),
    st.builds("{}{} {}   # {}".format, modern_types, array, names, comments),
    st.builds("int32 {} = {}".format, names.map(str.upper), st.integers(-99, 99)),
    st.builds("{} {}".format, modern_types, st.sampled_from([*OLD])),  # a field that has the name of a type
)


@given(st.lists(modern_lines))
def test_definition_without_types_of_ros1_stays_identical(lines: list[str]) -> None:
    text = "\n".join(lines)
    assert in_ros2(text) == text


@given(st.lists(st.one_of(modern_lines, st.builds("{}{} {}".format, st.sampled_from([*OLD]), array, names))))
def test_only_types_of_ros1_are_replaced(lines: list[str]) -> None:
    expected = []
    for line in lines:
        kind = re.match(r"\w*", line)
        word = kind[0] if kind else ""
        expected.append(OLD[word] + line[len(word) :] if word in OLD and "/" not in line.split(" ")[0] else line)
    assert in_ros2("\n".join(lines)).splitlines() == "\n".join(expected).splitlines()


def test_step_service_has_types_of_ros2() -> None:
    lines = definitions()["cellwright_msgs"]["srv/Step.srv"].splitlines()
    fields = [line.split()[:2] for line in lines if line and not line.startswith(("#", "-"))]
    assert ["builtin_interfaces/Duration", "duration"] in fields
    assert ["builtin_interfaces/Time", "time"] in fields


def test_definitions_are_those_of_messages_but_for_three_types() -> None:
    texts = definitions()
    ours = {
        name: text for name, text in TYPES.sources.items() if name.split("/")[0] in ("osrf_gear", "cellwright_msgs")
    }
    assert len(ours) >= 21
    for name, text in ours.items():
        package, namespace, last = name.split("/")
        assert texts[package][f"{namespace}/{last}.{namespace}"] == in_ros2(text)
    assert set(texts) == {name.split("/")[0] for name in TYPES.sources} - {"std_srvs"} | {
        *("tf2_msgs", "simulation_interfaces", "controller_manager_msgs")
    }


def test_control_msgs_have_fields_of_ros2() -> None:
    texts = definitions()["control_msgs"]
    assert set(texts) == {
        "action/FollowJointTrajectory.action",
        "action/GripperCommand.action",
        "action/ParallelGripperCommand.action",
        "msg/GripperCommand.msg",
        "msg/JointComponentTolerance.msg",
        "msg/JointTolerance.msg",
        "msg/JointTrajectoryControllerState.msg",
        "msg/SpeedScalingFactor.msg",
        "srv/QueryTrajectoryState.srv",
    }
    assert re.search(
        r"^trajectory_msgs/JointTrajectoryPoint reference$", texts["msg/JointTrajectoryControllerState.msg"], re.M
    )
    assert texts["action/FollowJointTrajectory.action"].count("\n---\n") == 2


def test_definitions_of_kilted_and_later_differ_in_two() -> None:
    jazzy, kilted = definitions("jazzy"), definitions("kilted")
    assert definitions("rolling") == kilted
    assert definitions("humble") == definitions() == jazzy
    differing = {
        f"{package}/{path}"
        for package, texts in jazzy.items()
        for path in texts
        if texts[path] != kilted[package][path]
    }
    assert differing == {
        "control_msgs/action/FollowJointTrajectory.action",
        "controller_manager_msgs/msg/HardwareComponentState.msg",
    }
    assert all(jazzy[package].keys() == kilted[package].keys() for package in jazzy)


@pytest.mark.parametrize("package", interface_packages())
def test_interface_package_names_all_its_files_and_dependencies(package: str) -> None:
    files = package_files(package)
    manifest, build = ET.fromstring(files["package.xml"]), files["CMakeLists.txt"].decode()
    assert manifest.findtext("name") == package
    assert manifest.findtext("member_of_group") == "rosidl_interface_packages"
    needed = {item.text for item in manifest.findall("depend")}
    assert needed == set(dependencies(package, definitions()[package])) <= STANDARD | {*interface_packages()}
    listed = re.findall(r'^  "(\w+/\w+\.\w+)"$', build, re.MULTILINE)
    assert listed == sorted(path for path in files if path.endswith((".msg", ".srv", ".action")))
    assert all(f"find_package({name} REQUIRED)" in build for name in needed)
    used = {name for path in listed for name in re.findall(r"(?m)^\s*([a-z]\w*)/[A-Z]", files[path].decode())} - {
        package
    }
    assert used <= needed


def test_dependencies_of_action_include_action_msgs() -> None:
    texts = {"action/Go.action": "geometry_msgs/Pose pose\n---\nmine/Kit kit\n---\nfloat64 left # std_msgs/Bool\n"}
    assert dependencies("mine", texts) == ["action_msgs", "geometry_msgs"]


@pytest.mark.parametrize("name", ["cell", "robot"])
def test_launch_file_declares_its_arguments_and_starts_cellwright(name: str) -> None:
    tree = ast.parse(package_files(LAUNCH)[f"launch/{name}.launch.py"])
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    declared = {
        node.args[0].value
        for node in calls
        if node.func.id == "DeclareLaunchArgument" and isinstance(node.args[0], ast.Constant)  # type: ignore[attr-defined]
    }
    used = {
        node.args[0].value
        for node in calls
        if node.func.id == "value" and isinstance(node.args[0], ast.Constant)  # type: ignore[attr-defined]
    }
    assert declared == used == {"trial" if name == "cell" else "robot", "namespace", "remap", "options"}
    assert sum(node.func.id == "ExecuteProcess" for node in calls) == 1  # type: ignore[attr-defined]
    imported = {node.module for node in tree.body if isinstance(node, ast.ImportFrom)}
    assert imported == {"launch", "launch.actions", "launch.substitutions", "typing"}


class _Launch:
    """Stand-ins for the classes of `launch`, which no registry has."""

    def __init__(self, values: dict[str, str]) -> None:
        self.values = values
        self.commands: list[list[str]] = []

    def execute(self, cmd: list[str], **_: str) -> str:
        self.commands.append(cmd)
        return "action"


@pytest.mark.parametrize(
    ("values", "last"),
    [
        ({}, ["serve", "lesson", "--ros2"]),
        ({"namespace": "/cell1/"}, ["serve", "lesson", "--ros2", "--ros-args", "-r", "__ns:=/cell1"]),
        (
            {"trial": "final05", "options": "--speed 2 --seed '3'", "remap": "/tf:=tf a:=b"},
            ["serve", "final05", "--ros2", "--speed", "2", "--seed", "3", "--ros-args", "-r", "/tf:=tf", "-r", "a:=b"],
        ),
    ],
)
def test_launch_file_passes_arguments_to_cellwright(values: dict[str, str], last: list[str]) -> None:
    source = package_files(LAUNCH)["launch/cell.launch.py"].decode()
    launch = _Launch({"trial": "lesson", "namespace": "", "remap": "", "options": ""} | values)
    body = "\n".join(line for line in source.splitlines() if not line.startswith("from launch"))
    scope: dict[str, object] = {
        "ExecuteProcess": launch.execute,
        "LaunchConfiguration": lambda name: type("Value", (), {"perform": lambda _, __: launch.values[name]})(),
    }
    exec(compile(body, "cell.launch.py", "exec"), scope)
    assert scope["start"](None) == ["action"]  # type: ignore[operator]
    (command,) = launch.commands
    assert command[0] == sys.executable
    assert command[-len(last) - 1 :] == [str(Path(cellwright.__file__).parents[1]), *last]


def test_unknown_package_is_refused_with_suggestion() -> None:
    with pytest.raises(UnknownNameError, match="did you mean osrf_gear"):
        package_files("osrf_gaer")
