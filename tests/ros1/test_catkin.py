"""A catkin workspace from nothing to programs that work the cell, by the steps of lessons of 2017.

A Python without ROS is first on the search path throughout, as on many machines of today.
"""

import shlex
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.ros1.first_step import BUILD, FirstStep
from tests.ros1.ground import Ground, ground
from tests.ros1.requirement import system_path
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

LANGUAGES = {"ROS_LANG_DISABLE": "geneus:genlisp:gennodejs"}
"""For the message generators: unused languages would take half of the build."""

LESSON_CMAKE = """\
cmake_minimum_required(VERSION 2.8.3)
project(industrial_control)

find_package(catkin REQUIRED COMPONENTS
  rospy
  osrf_gear
  sensor_msgs
  std_srvs
  trajectory_msgs
)

catkin_package(
)

include_directories(
  ${catkin_INCLUDE_DIRS}
)
"""

LAUNCH = """\
<launch>
  <arg name="config_file" default="$(find industrial_control)/config/my_config.yaml"/>
  <node pkg="osrf_gear" type="gear.py" name="ariac_node" output="screen"
    args="--development-mode -f $(arg config_file)" />
</launch>
"""

TASKER = """\
#! /usr/bin/env python
import rospy
from ariac_example import ariac_example as ariac
from osrf_gear.msg import Proximity


class PerformTaskClass(ariac.MyCompetitionClass):
    def __init__(self):
        ariac.MyCompetitionClass.__init__(self)
        self.beam_sub = rospy.Subscriber("/ariac/break_beam", Proximity, self.beam)
        self.readings = 0

    def beam(self, data):
        self.readings += 1


if __name__ == "__main__":
    rospy.init_node("tasker")
    task = PerformTaskClass()
    ariac.connect_callbacks(task)
    ariac.start_competition()
    while not rospy.is_shutdown() and not (task.readings > 5 and task.received_orders):
        rospy.sleep(0.1)
    print("tasker: " + task.received_orders[0].order_id)
"""

CPP_CMAKE = """\
cmake_minimum_required(VERSION 3.0.2)
project(cpp_client)
find_package(catkin REQUIRED COMPONENTS cellwright_msgs control_msgs osrf_gear roscpp)
catkin_package()
include_directories(${catkin_INCLUDE_DIRS})
add_executable(client src/client.cpp)
add_dependencies(client ${catkin_EXPORTED_TARGETS})
target_link_libraries(client ${catkin_LIBRARIES})
"""

CPP_CLIENT = """\
// Hears an order and the controller's state, moves the arm, grips, asks for material and sends an AGV off.
#include <cellwright_msgs/Step.h>
#include <control_msgs/JointTrajectoryControllerState.h>
#include <cstdio>
#include <osrf_gear/AGVControl.h>
#include <osrf_gear/GetMaterialLocations.h>
#include <osrf_gear/Order.h>
#include <osrf_gear/VacuumGripperControl.h>
#include <ros/ros.h>
#include <trajectory_msgs/JointTrajectory.h>

osrf_gear::Order order;
control_msgs::JointTrajectoryControllerState state;
void hear(const osrf_gear::Order::ConstPtr & message) { order = *message; }
void watch(const control_msgs::JointTrajectoryControllerState::ConstPtr & message) { state = *message; }

int main(int argc, char ** argv)
{
  ros::init(argc, argv, "cpp_client");
  ros::NodeHandle node;
  ros::Subscriber orders = node.subscribe("/ariac/orders", 10, hear);
  ros::Subscriber states = node.subscribe("/ariac/arm/state", 10, watch);
  ros::Publisher arm = node.advertise<trajectory_msgs::JointTrajectory>("/ariac/arm/command", 10);
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(120);
  auto pass = [&](auto condition) {
    while (ros::ok() && !condition() && ros::WallTime::now() < end) {
      ros::spinOnce();
      ros::WallDuration(0.01).sleep();
    }
    return condition();
  };
  if (!pass([&] { return !order.kits.empty() && !state.joint_names.empty() && arm.getNumSubscribers() > 0; })) return 1;
  std::printf("order %s for %zu parts\\n", order.order_id.c_str(), order.kits[0].objects.size());

  trajectory_msgs::JointTrajectory command;
  command.joint_names = state.joint_names;
  command.points.resize(1);
  command.points[0].positions = state.actual.positions;
  command.points[0].positions[0] += 0.25;
  command.points[0].time_from_start = ros::Duration(1.0);
  const double goal = command.points[0].positions[0];
  arm.publish(command);
  if (!pass([&] { return std::abs(state.actual.positions[0] - goal) < 0.06; })) return 2;
  std::printf("moved %s\\n", state.joint_names[0].c_str());

  osrf_gear::VacuumGripperControl grip;
  grip.request.enable = true;
  osrf_gear::GetMaterialLocations where;
  where.request.material_type = "piston_rod_part";
  osrf_gear::AGVControl send;
  send.request.kit_type = order.kits[0].kit_type;
  if (!ros::service::call("/ariac/gripper/control", grip) || !grip.response.success) return 3;
  if (!ros::service::call("/ariac/material_locations", where)) return 4;
  if (!ros::service::call("/ariac/agv1", send) || !send.response.success) return 5;
  for (const auto & unit : where.response.storage_units) std::printf("found %s\\n", unit.unit_id.c_str());
  return 0;
}
"""


class Workspace:
    """Workspace, and a shell in it."""

    def __init__(self, folder: Path, ros: Ground) -> None:
        """Set the folder, and the ground to run on."""
        self.folder = folder
        self._ros = ros

    def start(self, script: str) -> Process:
        """Start a script of bash.

        Args:
            script: its text.
        """
        path = f"{Path(sys.executable).parent}:{system_path()}"
        return self._ros.start(
            ["bash", "-e", "-c", f"cd {shlex.quote(str(self.folder))}\n{script}"],
            folder=None,
            PATH=path,
            PYTHONPATH="",
            **LANGUAGES,
        )

    def bash(self, script: str, within: float = TIMEOUT) -> str:
        """Return the output of a script that succeeds.

        Args:
            script: its text.
            within: the limit [s].
        """
        process = self.start(script)
        assert process.finish(within) == 0, process.out[-6000:] + process.err[-6000:]
        return process.out

    @contextmanager
    def launched(self, setup: str, arguments: str, trial: str) -> Iterator[None]:
        """Run the lesson's launch file within a block.

        Args:
            setup: the file that a shell sources.
            arguments: of the launch file.
            trial: the name of the cell, once it is ready.
        """
        launch = self.start(f"source {setup}; exec roslaunch industrial_control simulate.launch {arguments}")
        try:
            launch.wait_for(f"^ready: {trial} ")
            yield
        finally:
            launch.interrupt()
        assert not launch.relatives()
        assert "Traceback" not in launch.out + launch.err


@pytest.fixture(scope="module")
def workspace(
    first_step: FirstStep, tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path
) -> Iterator[Workspace]:
    """A workspace in which everything is built: the cell's packages, the lesson's, and one in C++.

    The cell's are built already. CMake's cache is gone, so that `catkin_make` configures from nothing.
    """
    sources, own = first_step.workspace / "src", ("industrial_control", "cpp_client")
    with ground(tmp_path_factory.mktemp("catkin"), ros1_messages, roscore=True) as ros:
        workspace = Workspace(first_step.workspace, ros)
        (workspace.folder / "build" / "CMakeCache.txt").unlink()
        try:
            workspace.bash("cd src; catkin_create_pkg industrial_control rospy")
            workspace.bash("cd src; catkin_create_pkg cpp_client roscpp osrf_gear")
            fill(sources)
            workspace.bash("catkin_make", BUILD)
            yield workspace
        finally:
            for package in own:
                shutil.rmtree(sources / package, ignore_errors=True)


def fill(sources: Path) -> None:
    """Write the lesson's sources, and the client in C++."""
    lesson, client = sources / "industrial_control", sources / "cpp_client"
    needs = "".join(f"<build_depend>{name}</build_depend>" for name in ("osrf_gear", "sensor_msgs", "std_srvs"))
    rospy = "<build_depend>rospy</build_depend>"
    manifest = (lesson / "package.xml").read_text().replace(rospy, f"{rospy}{needs}")
    assert needs in manifest
    for path, text in {
        lesson / "package.xml": manifest,
        lesson / "CMakeLists.txt": LESSON_CMAKE,
        lesson / "launch" / "simulate.launch": LAUNCH,
        lesson / "config" / "my_config.yaml": (sources / "ariac/osrf_gear/config/sample.yaml").read_text(),
        lesson / "scripts" / "tasker.py": TASKER,
        client / "CMakeLists.txt": CPP_CMAKE,
        client / "src" / "client.cpp": CPP_CLIENT,
    }.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    (lesson / "scripts" / "tasker.py").chmod(0o755)


@pytest.mark.parametrize("setup", ["install/setup.bash", "devel/setup.bash"])
def test_shell_with_workspace_finds_packages(workspace: Workspace, setup: str) -> None:
    sources = workspace.folder / "src"
    found = workspace.bash(
        f"""source {setup}
        rospack find osrf_gear; rospack find industrial_control; rosmsg md5 osrf_gear/Order
        python -c 'import osrf_gear.msg, control_msgs.msg, rospy; print(osrf_gear.msg.Order._md5sum)'"""
    ).split()
    assert found[:2] == [str(sources / "ariac" / "osrf_gear"), str(sources / "industrial_control")]
    assert found[2] == found[3]
    assert [*workspace.folder.glob("devel/lib/python3*/*-packages/osrf_gear")] != []


def test_rosrun_finds_launcher_once(workspace: Workspace) -> None:
    printed = workspace.bash(
        "source devel/setup.bash; rosrun osrf_gear gear.py -d -n -f `catkin_find --share osrf_gear`/config/sample.yaml"
    )
    assert "# file: gear.launch\n" in printed


def test_lesson_node_and_cpp_client_work_the_cell(workspace: Workspace) -> None:
    with workspace.launched("install/setup.bash", "", "my_config"):
        tasker = workspace.bash("source devel/setup.bash; rosrun industrial_control tasker.py")
        assert "tasker: order_0\n" in tasker
        said = workspace.bash("source devel/setup.bash; rosrun cpp_client client").splitlines()
        assert said[:2] == ["order order_0 for 2 parts", "moved linear_arm_actuator_joint"]
        assert set(said[2:]) == {"found bin7", "found belt"}


def test_cpp_example_node_starts_competition(workspace: Workspace) -> None:
    config = "config_file:=$(rospack find ariac_example)/config/sample_gear_conf.yaml"
    with workspace.launched("devel/setup.bash", config, "sample_gear_conf"):
        node = workspace.start(
            "source devel/setup.bash; unset ROSCONSOLE_CONFIG_FILE; export ROSCONSOLE_STDOUT_LINE_BUFFERED=1; "
            "exec rosrun ariac_example ariac_example_node"
        )
        node.wait_for("the competition has started")
        node.wait_for("sending the arm to its zero position")
        node.interrupt()
