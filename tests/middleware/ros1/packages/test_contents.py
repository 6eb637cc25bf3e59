"""Files of the packages: one source for each, with the paths of this installation where needed."""

import ast
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import cellwright
from cellwright.config.trial.catalogue import bundled, bundled_sensors, find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages import TYPES
from cellwright.middleware.ros1.packages.contents import IO_TELEOP, MESSAGE_PACKAGES, PACKAGES, package_files
from cellwright.util.errors import UnknownNameError

BIN = Path("/somewhere/bin")
NOT_OURS = {"catkin", "actionlib_msgs", "geometry_msgs", "message_generation", "message_runtime", "roscpp", "rospy"} | {
    "sensor_msgs",
    "std_msgs",
    "std_srvs",
    "trajectory_msgs",
}


@pytest.mark.parametrize("package", PACKAGES)
def test_manifest_has_required_tags_and_known_dependencies(package: str) -> None:
    root = ET.fromstring(package_files(package, BIN)["package.xml"])
    assert root.findtext("name") == package
    assert all(root.findtext(tag) for tag in ("version", "description", "maintainer", "license"))
    needed = {item.text for item in root if item.tag.endswith("depend")}
    assert needed <= NOT_OURS | set(PACKAGES)


@pytest.mark.parametrize("package", PACKAGES)
def test_build_components_are_in_manifest(package: str) -> None:
    files = package_files(package, BIN)
    found = re.search(rb"COMPONENTS([^)]*)\)", files["CMakeLists.txt"])
    assert found or package == IO_TELEOP
    for name in found[1].decode().split() if found else ():
        assert f"<depend>{name}<" in (text := files["package.xml"].decode()) or f"<build_depend>{name}<" in text


@pytest.mark.parametrize("package", MESSAGE_PACKAGES)
def test_package_definitions_match_message_sources(package: str) -> None:
    files = package_files(package, BIN)
    definitions = [path for path in files if path.endswith((".msg", ".srv"))]
    assert definitions
    for path in definitions:
        namespace, name = Path(path).parts
        full = f"{package}/{namespace}/{Path(name).stem}"
        assert files[path].decode() == TYPES.sources[full]


def test_action_has_seven_messages() -> None:
    names = {Path(path).stem for path in package_files("control_msgs", BIN)}
    for part in ("Action", "ActionGoal", "ActionResult", "ActionFeedback", "Goal", "Result", "Feedback"):
        assert f"FollowJointTrajectory{part}" in names
        assert f"GripperCommand{part}" in names


def test_messages_that_only_ros2_has_are_left_out() -> None:
    assert not [path for path in package_files("control_msgs", BIN) if "ParallelGripper" in path]
    assert "control_msgs/msg/ParallelGripperCommandActionGoal" in TYPES.sources


def test_configurations_include_bundled_trials() -> None:
    files = package_files("osrf_gear", BIN)
    for name in (*bundled(), *bundled_sensors()):
        assert files[f"config/{name}.yaml"] == find_trial(name).read_bytes()
    for name in ("sample", "sample_scenario1", "comp_conf1", "qual3b", "final15", "example_custom_config"):
        assert f"config/{name}.yaml" in files


def test_configurations_of_package_load_without_warnings(tmp_path: Path) -> None:
    for package in PACKAGES:
        for path, content in package_files(package, BIN).items():
            if path.startswith("config/"):
                (tmp_path / Path(path).name).write_bytes(content)
    team = tmp_path / "sample_user_config.yaml"
    custom = load_trial([tmp_path / "example_custom_config.yaml", team])
    assert not custom.warnings
    assert custom.trial.has_arm
    assert [len(order.kits) for order in custom.trial.orders] == [1, 1]
    final = load_trial([tmp_path / "final01.yaml", team]).trial
    assert {sensor.type for sensor in final.sensors} == {
        "break_beam",
        "proximity_sensor",
        "logical_camera",
        "laser_profiler",
    }
    example = load_trial([tmp_path / "sample_gear_conf.yaml"]).trial
    node = package_files("ariac_example", BIN)["src/ariac_example_node.cpp"].decode()
    for sensor in example.sensors:
        assert f'"/ariac/{sensor.name}' in node


def test_descriptions_include_bundled_robots() -> None:
    catalogue = Path(cellwright.__file__).parent / "config" / "robot" / "catalogue"
    files = package_files(IO_TELEOP, BIN)
    bundled = [path for path in catalogue.rglob("*") if path.is_file()]
    laid_out = [path for path in files if path.startswith("io_teleop_robot_descriptions/")]
    assert len(laid_out) == len(bundled) >= 2
    qinglong = (catalogue / "qinglong" / "vr_configs.yml").read_bytes()
    assert files["io_teleop_robot_descriptions/OpenLoong/vr_configs.yml"] == qinglong


def test_scripts_have_paths_of_this_installation() -> None:
    files = package_files("osrf_gear", BIN)
    values = {
        target.id: ast.literal_eval(statement.value)
        for statement in ast.parse(files["script/gear.py"]).body
        if isinstance(statement, ast.Assign)
        for target in statement.targets
        if isinstance(target, ast.Name)
    }
    assert values["PYTHON"] == sys.executable
    assert Path(values["PLACE"]) == Path(cellwright.__file__).parents[1]
    assert str(BIN) in files["env-hooks/50.cellwright.sh"].decode()
    left = [f"{package}/{path}" for package in PACKAGES for path, content in _all(package) if b"@CELLWRIGHT" in content]
    assert left == []


def test_files_with_shebang_are_the_programs() -> None:
    programs = {path for package in PACKAGES for path, content in _all(package) if content.startswith(b"#!")}
    assert programs == {
        "script/gear.py",
        "script/ariac_example_node.py",
        "scripts/general_sim_robot_control_node.py",
        "scripts/openloong_controller_node.py",
    }


def test_unknown_package_is_refused_with_suggestion() -> None:
    with pytest.raises(UnknownNameError, match="did you mean osrf_gear"):
        package_files("osrf_gaer", BIN)


def _all(package: str) -> list[tuple[str, bytes]]:
    return list(package_files(package, BIN).items())
