"""The lesson's own steps with catkin, to the letter, and a client in C++ that is built and run."""

import os
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros1.ground import Ground, ground
from tests.ros1.processes import Process

pytestmark = pytest.mark.ros1

SOURCE = Path(__file__).parents[2] / "src"

BUILD_DEPENDS = "".join(
    f"  <build_depend>{name}</build_depend>\n" for name in ("osrf_gear", "sensor_msgs", "std_srvs", "trajectory_msgs")
)

PYTHON_PACKAGE = """\
cmake_minimum_required(VERSION 2.8.3)
project(industrial_control)

find_package(catkin REQUIRED COMPONENTS
  rospy
  osrf_gear
  sensor_msgs
  std_srvs
  trajectory_msgs
)

catkin_package()

include_directories(
  ${catkin_INCLUDE_DIRS}
)

install(FILES
  config/sample_gear_conf.yaml
  DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/config
)
"""

LAUNCH = """\
<launch>
  <arg name="config_file" default="$(find industrial_control)/config/sample_gear_conf.yaml"/>
  <node pkg="osrf_gear" type="gear.py" name="ariac_node" output="screen"
        args="--development-mode -f $(arg config_file)" />
</launch>
"""

CPP_PACKAGE = """\
cmake_minimum_required(VERSION 3.0.2)
project(cpp_client)
find_package(catkin REQUIRED COMPONENTS roscpp osrf_gear sensor_msgs std_srvs trajectory_msgs)
catkin_package()
include_directories(${catkin_INCLUDE_DIRS})
add_executable(worker src/worker.cpp)
add_dependencies(worker ${catkin_EXPORTED_TARGETS})
target_link_libraries(worker ${catkin_LIBRARIES})
"""

WORKER = """\
#include <cmath>
#include <iostream>
#include <osrf_gear/AGVControl.h>
#include <osrf_gear/LogicalCameraImage.h>
#include <osrf_gear/Order.h>
#include <osrf_gear/VacuumGripperControl.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>
#include <trajectory_msgs/JointTrajectory.h>

static double elbow = 0.0;
static int states = 0;
static std::string order, seen;

void onStates(const sensor_msgs::JointState::ConstPtr & msg) { elbow = msg->position[0]; ++states; }
void onOrder(const osrf_gear::Order::ConstPtr & msg) { order = msg->order_id + "/" + msg->kits[0].objects[0].type; }
void onImage(const osrf_gear::LogicalCameraImage::ConstPtr & msg) {
  if (!msg->models.empty()) seen = msg->models[0].type;
}

template <class Condition> bool await(Condition met, double seconds) {
  ros::Time end = ros::Time::now() + ros::Duration(seconds);
  for (ros::Rate rate(100); ros::ok() && !met(); rate.sleep()) {
    ros::spinOnce();
    if (ros::Time::now() > end) return false;
  }
  return true;
}

int main(int argc, char ** argv) {
  ros::init(argc, argv, "worker");
  ros::NodeHandle node;
  ros::Subscriber a = node.subscribe("/ariac/joint_states", 10, onStates);
  ros::Subscriber b = node.subscribe("/ariac/orders", 10, onOrder);
  ros::Subscriber c = node.subscribe("/ariac/logical_camera", 10, onImage);
  ros::Publisher arm = node.advertise<trajectory_msgs::JointTrajectory>("/ariac/arm/command", 10);
  bool all = await([] { return states > 100; }, 20.0);
  all = await([&] { return arm.getNumSubscribers() == 1; }, 10.0) && all;

  std_srvs::Trigger start;
  all = ros::service::call("/ariac/start_competition", start) && start.response.success && all;
  all = await([] { return order == "order_0/piston_rod_part" && !seen.empty(); }, 5.0) && all;

  trajectory_msgs::JointTrajectory goal;
  goal.joint_names = {"elbow_joint", "linear_arm_actuator_joint", "shoulder_lift_joint", "shoulder_pan_joint",
                      "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"};
  goal.points.resize(1);
  goal.points[0].positions = {2.5, 0.0, -1.2, 3.2, 3.5, -1.51, 0.0};
  goal.points[0].time_from_start = ros::Duration(1.0);
  arm.publish(goal);
  all = await([] { return std::abs(elbow - 2.5) < 0.05; }, 10.0) && all;

  osrf_gear::VacuumGripperControl gripper;
  gripper.request.enable = true;
  all = ros::service::call("/ariac/gripper/control", gripper) && gripper.response.success && all;
  osrf_gear::AGVControl agv;
  agv.request.kit_type = "order_0_kit_0";
  all = ros::service::call("/ariac/agv1", agv) && agv.response.success && all;
  std::cout << (all ? "all went well: " : "something failed: ") << order << " " << seen << " " << elbow << std::endl;
  return all ? 0 : 1;
}
"""


class Workspace:
    """A shell in a catkin workspace; the variables are a newcomer's, another Python comes first on the path."""

    def __init__(self, ros: Ground, folder: Path) -> None:
        """Take the ground it stands on, and its folder."""
        self.ros = ros
        self.folder = folder

    def bash(self, script: str, within: float = 240.0) -> str:
        """What a script prints that ends well; it begins in the workspace."""
        return self.ros.tool("bash", "-ec", f"{self._begin}\n{script}", within=within)

    def start(self, script: str) -> Process:
        """A script that goes on meanwhile, as in a second terminal."""
        return self.ros.start(["bash", "-ec", f"{self._begin}\n{script}"])

    @property
    def _begin(self) -> str:
        path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        return f"unset PYTHONPATH ROS_PACKAGE_PATH; export PATH={shlex.quote(path)}; cd {self.folder}"

    def write(self, name: str, text: str) -> None:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Workspace]:
    """What `cellwright ros1-workspace` lays out and builds."""
    folder = tmp_path_factory.mktemp("catkin")
    with ground(folder / "ros", ros1_messages, roscore=True) as ros:
        made = Workspace(ros, folder / "simulation_ws")
        made.folder.mkdir()
        made.bash(f"PYTHONPATH={SOURCE} {sys.executable} -m cellwright ros1-workspace .")
        yield made


def test_the_lessons_package(workspace: Workspace) -> None:
    """Created, described, built and launched as the class does it."""
    workspace.bash("cd src; catkin_create_pkg industrial_control rospy")
    manifest = workspace.folder / "src/industrial_control/package.xml"
    text = manifest.read_text()
    assert "<build_depend>rospy</build_depend>" in text
    manifest.write_text(text.replace("  <build_depend>rospy</build_depend>\n", BUILD_DEPENDS, 1))
    workspace.write("src/industrial_control/CMakeLists.txt", PYTHON_PACKAGE)
    workspace.write("src/industrial_control/launch/simulate.launch", LAUNCH)
    sample = workspace.bash("source devel/setup.bash; rospack find ariac_example").strip()
    config = (Path(sample) / "config/sample_gear_conf.yaml").read_text()
    workspace.write("src/industrial_control/config/sample_gear_conf.yaml", config)
    assert "Built target" in workspace.bash("catkin_make --pkg industrial_control; echo; echo Built target")

    launch = workspace.start("source install/setup.bash; exec roslaunch industrial_control simulate.launch")
    launch.wait_for("^ready: ", 30.0)
    assert "osrf_gear/Order" in workspace.bash("source devel/setup.bash; rostopic type /ariac/orders; rosservice list")
    assert launch.interrupt(20.0) == 0
    assert "Traceback" not in launch.out + launch.err
    assert not launch.relatives()


def test_a_client_in_cpp(workspace: Workspace) -> None:
    workspace.bash("cd src; catkin_create_pkg cpp_client roscpp osrf_gear sensor_msgs std_srvs trajectory_msgs")
    workspace.write("src/cpp_client/CMakeLists.txt", CPP_PACKAGE)
    workspace.write("src/cpp_client/src/worker.cpp", WORKER)
    workspace.bash("catkin_make --pkg cpp_client")
    # As the class starts it without a launch file.
    config = "$(rospack find osrf_gear)/config/sample.yaml"
    gear = workspace.start(f"source devel/setup.bash; exec rosrun osrf_gear gear.py --development-mode -f {config}")
    gear.wait_for("^ready: ", 30.0)
    said = workspace.bash("source devel/setup.bash; rosrun cpp_client worker")
    assert said.startswith("all went well: order_0/piston_rod_part piston_rod_part ")
    gear.interrupt(20.0)
    assert not gear.relatives()
