"""MoveIt configuration: SRDF and YAML as MoveIt reads them, names against the URDF, launch file with stand-ins."""

from __future__ import annotations

import ast
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import xacro
import yaml

from cellwright.middleware.ros2.packages.contents import MOVEIT
from cellwright.middleware.ros2.packages.moveit import PlannedArm, PlannedCell, moveit_files, srdf

LINKS = ("world", "rail", "base", "upper", "lower", "flange", "cup")
JOINTS = (("slide", "prismatic"), ("turn", "revolute"), ("lift", "continuous"))
NAMES = tuple(joint for joint, _ in JOINTS)

SRDF = {
    "virtual_joint": ({"name", "type", "parent_frame", "child_link"}, set()),
    "group": ({"name"}, {"link", "joint", "chain", "group"}),
    "chain": ({"base_link", "tip_link"}, set()),
    "link": ({"name"}, set()),
    "group_state": ({"name", "group"}, {"joint"}),
    "end_effector": ({"name", "parent_link", "group", "parent_group"}, set()),
    "passive_joint": ({"name"}, set()),
    "disable_collisions": ({"link1", "link2", "reason"}, set()),
}
"""Elements of an SRDF that srdfdom reads: their attributes, and the elements in them."""

LIMITS = {"has_velocity_limits", "max_velocity", "has_acceleration_limits", "max_acceleration"}


def urdf() -> str:
    """Return a rail with an arm of two joints, and a cup on a joint that no controller moves."""
    joints = [("rail_base", "fixed"), *JOINTS, ("flange_joint", "fixed"), ("cup_joint", "revolute")]
    parents = ("world", "rail", "base", "upper", "lower", "lower")
    shape = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = "".join(f'<link name="{name}">{inertia}{"" if name == "world" else shape}</link>' for name in LINKS)
    return (
        f'<robot name="crane">{links}'
        + "".join(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 0.5"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="2"/></joint>'
            for (name, kind), parent, child in zip(joints, parents, LINKS[1:], strict=True)
        )
        + "</robot>"
    )


def planned_arm(name: str = "arm", prefix: str = "", joints: tuple[str, ...] = NAMES) -> PlannedArm:
    """Return the arm of the description, whose names have a prefix."""
    names = tuple(prefix + joint for joint in joints)
    return PlannedArm(
        name=name,
        joints=names,
        flange=f"{prefix}flange",
        tool=(f"{prefix}cup",),
        home=dict(zip(names, (0.5, -1.0, 0.0)[-len(names) :], strict=True)),
        max_velocity=dict.fromkeys(names, 2.0),
        max_acceleration=dict.fromkeys(names, 5.0),
        action=f"/{prefix}crane_controller/follow_joint_trajectory",
    )


@pytest.fixture
def cell() -> PlannedCell:
    return PlannedCell(urdf(), (planned_arm(),), {("rail", "base"): "Adjacent", ("rail", "cup"): "Never"})


@pytest.fixture
def pair() -> PlannedCell:
    """Return a cell with two of these arms."""
    root = ET.Element("robot", name="pair")
    ET.SubElement(root, "link", name="world")
    for prefix in ("left_", "right_"):
        for element in ET.fromstring(urdf()):
            if element.get("name") == "world":
                continue
            element.attrib["name"] = prefix + element.attrib["name"]
            for end in element.findall("parent") + element.findall("child"):
                end.attrib["link"] = end.attrib["link"] if end.get("link") == "world" else prefix + end.attrib["link"]
            root.append(element)
    arms = tuple(planned_arm(side, f"{side}_") for side in ("left", "right"))
    return PlannedCell(ET.tostring(root, encoding="unicode"), arms, {})


def check_srdf(text: str, description: str) -> ET.Element:
    """Check elements, attributes and names of an SRDF as srdfdom and MoveIt do; return its root."""
    semantic, robot = ET.fromstring(text), ET.fromstring(description)
    assert semantic.attrib == {"name": robot.attrib["name"]}
    for element in semantic:
        attributes, inside = SRDF[element.tag]
        assert set(element.attrib) == attributes, element.tag
        assert {each.tag for each in element} <= inside
    links = {each.attrib["name"] for each in robot.findall("link")}
    movable = {each.attrib["name"] for each in robot.findall("joint") if each.get("type") != "fixed"}
    groups = {each.attrib["name"] for each in semantic.findall("group")}
    for element in semantic.iter():
        for attribute in ("base_link", "tip_link", "child_link", "parent_link", "link1", "link2"):
            assert element.get(attribute, "world") in links
        if element.tag in ("group_state", "end_effector"):
            assert element.attrib["group"] in groups
        if element.tag == "link":
            assert element.attrib["name"] in links
        if element.tag in ("joint", "passive_joint"):
            assert element.attrib["name"] in movable
    children = {each.attrib["link"] for each in robot.findall("joint/child")}
    (virtual,) = semantic.findall("virtual_joint")
    assert virtual.attrib["child_link"] not in children, "MoveIt takes it only at the root of the robot"
    assert virtual.attrib["type"] in ("fixed", "planar", "floating")
    assert {each.attrib["reason"] for each in semantic.findall("disable_collisions")} <= {"Adjacent", "Always", "Never"}
    return semantic


def chain(description: str, base: str, tip: str) -> list[str]:
    """Return the joints between two links that are not fixed, from the base on."""
    above = {_link(each, "child"): each for each in ET.fromstring(description).findall("joint")}
    found = []
    while tip != base:
        joint = above[tip]
        if joint.get("type") != "fixed":
            found.append(joint.attrib["name"])
        tip = _link(joint, "parent")
    return found[::-1]


def _link(joint: ET.Element, end: str) -> str:
    found = joint.find(end)
    assert found is not None
    return found.attrib["link"]


def test_groups_are_chains_with_and_without_the_rail(cell: PlannedCell) -> None:
    semantic = check_srdf(srdf(cell), cell.urdf)
    chains = {group.attrib["name"]: group.find("chain") for group in semantic.findall("group")}
    joints = {
        name: chain(cell.urdf, each.attrib["base_link"], each.attrib["tip_link"])
        for name, each in chains.items()
        if each is not None
    }
    assert joints == {"arm_on_rail": ["slide", "turn", "lift"], "arm": ["turn", "lift"]}
    assert [each.attrib["name"] for each in semantic.findall("passive_joint")] == ["cup_joint"]


def test_arm_without_rail_has_one_group() -> None:
    text = urdf().replace('"prismatic"', '"fixed"')
    fixed = PlannedCell(text, (planned_arm(joints=("turn", "lift")),), {})
    semantic = check_srdf(srdf(fixed), text)
    assert [each.attrib["name"] for each in semantic.findall("group")] == ["arm", "tool"]
    (tool,) = semantic.findall("end_effector")
    assert tool.attrib == {"name": "tool", "parent_link": "lower", "group": "tool", "parent_group": "arm"}


def test_arm_without_tool_has_no_end_effector(cell: PlannedCell) -> None:
    bare = replace(cell, arms=(replace(cell.arms[0], tool=()),))
    semantic = check_srdf(srdf(bare), bare.urdf)
    assert semantic.find("end_effector") is None
    assert [each.attrib["name"] for each in semantic.findall("group")] == ["arm_on_rail", "arm"]


def test_several_arms_have_groups_of_their_own_and_one_together(pair: PlannedCell) -> None:
    semantic = check_srdf(srdf(pair), pair.urdf)
    groups = {each.attrib["name"]: each for each in semantic.findall("group")}
    assert list(groups) == [*("left_on_rail", "left", "left_tool", "right_on_rail", "right", "right_tool"), "both"]
    assert [each.attrib["name"] for each in groups["both"]] == ["left_on_rail", "right_on_rail"]
    home = next(each for each in semantic.findall("group_state") if each.get("group") == "both")
    assert len(home) == 6
    assert [each.attrib["name"] for each in semantic.findall("passive_joint")] == ["left_cup_joint", "right_cup_joint"]
    files = moveit_files(pair)
    controllers = yaml.safe_load(files["config/moveit_controllers.yaml"])["moveit_simple_controller_manager"]
    assert controllers["controller_names"] == ["left_crane_controller", "right_crane_controller"]
    limits = yaml.safe_load(files["config/joint_limits.yaml"])["joint_limits"]
    assert set(limits) == {joint for arm in pair.arms for joint in arm.joints}
    assert list(yaml.safe_load(files["config/kinematics.yaml"])) == ["left_on_rail", "left", "right_on_rail", "right"]


def test_group_of_all_arms_has_a_name_that_no_arm_has(pair: PlannedCell) -> None:
    named = replace(pair, arms=(replace(pair.arms[0], name="both"), pair.arms[1]))
    assert named.common_group == "both_arms"
    three = replace(pair, arms=(*pair.arms, pair.arms[0]))
    assert three.common_group == "all"


def test_unchecked_pairs_have_their_reasons(cell: PlannedCell) -> None:
    found = [dict(each.attrib) for each in check_srdf(srdf(cell), cell.urdf).findall("disable_collisions")]
    assert found == [
        {"link1": "rail", "link2": "base", "reason": "Adjacent"},
        {"link1": "rail", "link2": "cup", "reason": "Never"},
    ]


def test_home_is_a_state_of_each_group(cell: PlannedCell) -> None:
    states = {
        state.attrib["group"]: {each.attrib["name"]: float(each.attrib["value"]) for each in state}
        for state in ET.fromstring(srdf(cell)).findall("group_state")
    }
    assert states == {"arm_on_rail": cell.arms[0].home, "arm": {"turn": -1.0, "lift": 0.0}}


def test_configuration_has_the_keys_that_moveit_reads(cell: PlannedCell) -> None:
    files = moveit_files(cell)
    read = {path: yaml.safe_load(text) for path, text in files.items() if path.endswith((".yaml", "assistant"))}
    limits = read["config/joint_limits.yaml"]
    assert set(limits) == {"joint_limits", "default_velocity_scaling_factor", "default_acceleration_scaling_factor"}
    assert {joint: set(each) for joint, each in limits["joint_limits"].items()} == dict.fromkeys(
        cell.arms[0].joints, LIMITS
    )
    assert limits["joint_limits"]["turn"]["max_acceleration"] == 5.0
    solvers = read["config/kinematics.yaml"]
    assert list(solvers) == ["arm_on_rail", "arm"]
    assert all(each["kinematics_solver"] == "kdl_kinematics_plugin/KDLKinematicsPlugin" for each in solvers.values())
    controllers = read["config/moveit_controllers.yaml"]
    assert controllers["moveit_controller_manager"] == "moveit_ros_control_interface/Ros2ControlManager"
    simple = controllers["moveit_simple_controller_manager"]
    assert simple["controller_names"] == ["crane_controller"]
    assert simple["crane_controller"] == {
        "type": "FollowJointTrajectory",
        "action_ns": "follow_joint_trajectory",
        "default": True,
        "joints": list(cell.arms[0].joints),
    }
    cartesian = read["config/pilz_cartesian_limits.yaml"]["cartesian_limits"]
    assert set(cartesian) == {"max_trans_vel", "max_trans_acc", "max_trans_dec", "max_rot_vel"}
    assert [key for key, value in cartesian.items() if value <= 0] == ["max_trans_dec"], "its sign is MoveIt's"
    assert files["config/cellwright.urdf"].decode() == cell.urdf
    named = read[".setup_assistant"]["moveit_setup_assistant_config"]
    assert named["urdf"]["package"] == MOVEIT
    assert {named["urdf"]["relative_path"], named["srdf"]["relative_path"]} <= set(files)


def test_package_installs_and_depends_on_what_it_has(cell: PlannedCell) -> None:
    files = moveit_files(cell)
    manifest, build = ET.fromstring(files["package.xml"]), files["CMakeLists.txt"].decode()
    assert manifest.findtext("name") == MOVEIT
    assert f"project({MOVEIT} NONE)" in build
    installed = re.findall(r"install\(\w+ ([\w./ ]+) DESTINATION", build)
    named = {name for words in installed for name in words.split()}
    assert "meshes" in named
    assert {path for path in files if "/" in path or path.startswith(".")} == {
        path for path in files if path in named or path.split("/")[0] in named
    }
    needed = {each.text for each in manifest.findall("exec_depend")}
    tree = ast.parse(files["launch/move_group.launch.py"])
    imported = {each.module or "" for each in ast.walk(tree) if isinstance(each, ast.ImportFrom)}
    assert {name.split(".")[0] for name in imported} - {"typing"} <= needed
    plugins = {"moveit_kinematics", "moveit_ros_control_interface", "moveit_planners_ompl", "moveit_ros_move_group"}
    assert plugins <= needed, "named in files only"


def _expanded(path: Path) -> str:
    return str(xacro.process_file(path).toxml())


class Configs:
    """Stand-in for MoveIt's reader of such packages, which no registry has: it reads the files that MoveIt reads."""

    def __init__(self, folder: Path) -> None:
        read = {path.name: path.read_text() for path in (folder / "config").iterdir()}
        self.package_path = folder
        self.joint_limits = {"robot_description_planning": yaml.safe_load(read["joint_limits.yaml"])}
        self.robot_description_kinematics = {"robot_description_kinematics": yaml.safe_load(read["kinematics.yaml"])}
        self.planning_pipelines: dict[str, Any] = {}
        self.robot_description = {"robot_description": _expanded(folder / "config" / "cellwright.urdf")}
        self.robot_description_semantic = {
            "robot_description_semantic": _expanded(folder / "config" / "cellwright.srdf")
        }
        self._values = {
            **self.robot_description,
            **self.robot_description_semantic,
            "robot_description_planning": yaml.safe_load(read["pilz_cartesian_limits.yaml"]),
            **yaml.safe_load(read["moveit_controllers.yaml"]),
        }

    def to_dict(self) -> dict[str, Any]:
        return self._values | self.planning_pipelines | self.robot_description_kinematics


class Builder:
    """Stand-in for the builder of `Configs`."""

    folder: Path

    def __init__(self, name: str, package_name: str) -> None:
        assert (name, package_name) == ("cellwright", MOVEIT)
        self._configs = Configs(self.folder)

    def planning_pipelines(self, pipelines: list[str]) -> Builder:
        self._configs.planning_pipelines = {"planning_pipelines": pipelines}
        return self

    def to_moveit_configs(self) -> Configs:
        return self._configs


def started(cell: PlannedCell, folder: Path, **values: str) -> list[dict[str, Any]]:
    """Return what the launch file starts for these values of its arguments."""
    for path, content in moveit_files(cell).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    source = (folder / "launch" / "move_group.launch.py").read_text()
    body = "\n".join(line for line in source.splitlines() if not line.startswith(("from launch", "from moveit")))
    Builder.folder = folder
    declared: dict[str, str] = {}
    scope: dict[str, Any] = {
        "DeclareLaunchArgument": lambda name, default_value, description: declared.update({name: default_value}),
        "LaunchConfiguration": lambda name: type("", (), {"perform": lambda *_: (declared | values)[name]})(),
        "LaunchDescription": list,
        "MoveItConfigsBuilder": Builder,
        "Node": lambda **given: given,
        "OpaqueFunction": lambda function: function,
    }
    exec(compile(body, "move_group.launch.py", "exec"), scope)
    *_, start = scope["generate_launch_description"]()
    assert set(values) <= set(declared) == {"namespace", "rviz"}
    found: list[dict[str, Any]] = start(None)
    return found


def parameters(node: dict[str, Any]) -> dict[str, Any]:
    """Return the parameters of a node by name; later ones count, as in files of parameters."""
    found: dict[str, Any] = {}

    def add(values: dict[str, Any], prefix: str) -> None:
        for name, value in values.items():
            if isinstance(value, dict):
                add(value, f"{prefix}{name}.")
            else:
                found[prefix + name] = value

    for each in node["parameters"]:
        add(each, "")
    return found


def test_launch_file_starts_move_group_in_simulation_time_with_the_whole_cell(
    cell: PlannedCell, tmp_path: Path
) -> None:
    (move_group,) = started(cell, tmp_path)
    assert (move_group["package"], move_group["executable"]) == ("moveit_ros_move_group", "move_group")
    values = parameters(move_group)
    assert values["use_sim_time"] is True
    assert values["ros_control_namespace"] == move_group["namespace"] == "/"
    for read, written in (("robot_description", cell.urdf), ("robot_description_semantic", srdf(cell))):
        assert ET.canonicalize(values[read], strip_text=True) == ET.canonicalize(written, strip_text=True)
    assert values["publish_robot_description_semantic"] is True
    assert values["moveit_controller_manager"].endswith("/Ros2ControlManager")
    assert values["robot_description_planning.joint_limits.turn.max_velocity"] == 2.0
    assert values["robot_description_planning.cartesian_limits.max_trans_vel"] == 1.0
    assert values["robot_description_kinematics.arm.kinematics_solver"]


def test_launch_file_follows_a_cell_into_its_namespace(cell: PlannedCell, tmp_path: Path) -> None:
    for node in started(cell, tmp_path, namespace="cell1/"):
        assert node["namespace"] == "/cell1"
        assert ("/clock", "clock") in node["remappings"]
        assert ("/tf_static", "tf_static") in node["remappings"]


def test_launch_file_starts_rviz_on_request(cell: PlannedCell, tmp_path: Path) -> None:
    *_, rviz = started(cell, tmp_path, rviz="true")
    assert rviz["package"] == "rviz2"
    shown = yaml.safe_load(Path(rviz["arguments"][1]).read_text())["Visualization Manager"]
    assert "moveit_rviz_plugin/MotionPlanning" in {each["Class"] for each in shown["Displays"]}
    assert shown["Global Options"]["Fixed Frame"] == ET.fromstring(srdf(cell))[0].attrib["parent_frame"]
    values = parameters(rviz)
    assert values["use_sim_time"] is True
    assert {"robot_description", "robot_description_semantic"} <= set(values), "the topic has no furniture"
