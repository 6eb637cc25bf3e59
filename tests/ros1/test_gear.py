"""Launcher, messages and example package with ROS's own tools."""

import stat
from pathlib import Path

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.ros1.host.installation import find_system
from cellwright.middleware.ros1.packages.contents import IO_TELEOP
from cellwright.middleware.ros1.packages.tree import ensure_tree, variables
from tests.ros1.ground import Ground
from tests.ros1.requirement import system_path
from tests.support.processes import Process
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

LAUNCH = """\
<launch>
  <arg name="config" default="$(find osrf_gear)/config/sample.yaml" />
  <node pkg="osrf_gear" type="gear.py" name="ariac_node" output="screen" {more}
        args="--development-mode -f $(arg config) -o {out}" />
</launch>
"""

ROBOT_LAUNCH = """\
<launch>
  <node pkg="io_teleop_robot_control_node" type="general_sim_robot_control_node.py" name="left_cell" output="screen"
        args="--robot_name tandem" />
</launch>
"""

PROGRAM = """\
#!/usr/bin/env python
import rospy
from ariac_example import ariac_example as ariac
from osrf_gear.msg import Order

rospy.init_node("program")
competition = ariac.MyCompetitionClass()
ariac.connect_callbacks(competition)
assert ariac.start_competition()
assert not ariac.start_competition()
while competition.joint_trajectory_publisher.get_num_connections() == 0:
    rospy.sleep(0.02)
goal = [2.5, 0.3, -1.2, 3.2, 3.5, -1.51, 0.0]
competition.send_arm_to_state(goal)
while competition.current_comp_state != "go" or not competition.received_orders:
    rospy.sleep(0.02)
assert isinstance(competition.received_orders[0], Order)
names = competition.arm_joint_names
def arrived():
    at = dict(zip(competition.current_joint_state.name, competition.current_joint_state.position))
    return all(abs(at[name] - value) < 0.05 for name, value in zip(names, goal))
while competition.current_joint_state is None:
    rospy.sleep(0.02)
end = rospy.Time.now() + rospy.Duration(100)
while not arrived():
    assert rospy.Time.now() < end
    rospy.sleep(0.02)
assert ariac.control_gripper(True)
while not competition.current_gripper_state.enabled:
    rospy.sleep(0.02)
assert ariac.control_agv(1, "order_0_kit_0")
assert not ariac.control_agv(1, "order_0_kit_0")
while competition.current_comp_state != "done":
    rospy.sleep(0.02)
print("all went well")
"""


class Shell:
    """Shell that has evaluated `cellwright ros1-env`."""

    def __init__(self, ros: Ground, paths: dict[str, str]) -> None:
        """Set the ground to run on, and the variables."""
        self._ros = ros
        self._paths = paths

    def start(self, *command: str, exits: bool = False) -> Process:
        """Start a program; with `exits` the simulator ends with its trial.

        Args:
            command: program and arguments.
            exits: set the variable that asks for it.
        """
        more = {"ARIAC_EXIT_ON_COMPLETION": "1"} if exits else {}
        return self._ros.start(list(command), folder=None, **self._paths, **more)

    def tool(self, *command: str) -> str:
        """Return the output of a program that succeeds.

        Args:
            command: program and arguments.
        """
        program = self.start(*command)
        assert program.finish() == 0, program.out + program.err
        return program.out

    def launched(self, folder: Path, more: str = "", *, exits: bool = False) -> Process:
        """Start a launch file with the cell in it, and wait until it is ready.

        Args:
            folder: for the file, and the launcher's output.
            more: attributes of the node.
            exits: the simulator ends with its trial.
        """
        file = folder / "simulate.launch"
        file.write_text(LAUNCH.format(more=more, out=folder / "out"))
        launch = self.start("roslaunch", str(file), exits=exits)
        launch.wait_for("^ready: sample ")
        return launch


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    ros = find_system()
    tree = ensure_tree(ros, tmp_path_factory.mktemp("cache"))
    return variables(tree, ros, {"PATH": system_path()})


@pytest.fixture
def alone(no_master: Ground, paths: dict[str, str]) -> Shell:
    """A shell without a master."""
    return Shell(no_master, paths)


@pytest.fixture
def shell(full_master: Ground, paths: dict[str, str]) -> Shell:
    """A shell with a roscore."""
    return Shell(full_master, paths)


def test_ros_tools_show_message_types(alone: Shell) -> None:
    assert alone.tool("rosmsg", "md5", "osrf_gear/Order").strip() == TYPES.md5("osrf_gear/Order")
    shown = alone.tool("rosmsg", "show", "osrf_gear/Order").splitlines()
    assert shown[:3] == ["string order_id", "osrf_gear/Kit[] kits", "  string kit_type"]
    assert "  geometry_msgs/Pose pose" in alone.tool("rosmsg", "show", "osrf_gear/LogicalCameraImage")
    assert alone.tool("rosmsg", "show", "std_msgs/String").strip() == "string data"
    assert alone.tool("rossrv", "md5", "osrf_gear/AGVControl").strip() == TYPES.md5("osrf_gear/AGVControl")
    assert alone.tool("rossrv", "show", "std_srvs/Trigger").split() == [
        *("---", "bool", "success", "string", "message")
    ]
    action = alone.tool("rosmsg", "md5", "control_msgs/FollowJointTrajectoryAction").strip()
    assert action == TYPES.md5("control_msgs/FollowJointTrajectoryAction")
    assert set(alone.tool("rosmsg", "package", "osrf_gear").split()) >= {"osrf_gear/Kit", "osrf_gear/Order"}


def test_rospack_finds_packages(alone: Shell) -> None:
    found = Path(alone.tool("rospack", "find", "osrf_gear").strip())
    assert (found / "config" / "qual1a.yaml").is_file()
    assert alone.tool("rospack", "depends1", "ariac_example").split() >= ["osrf_gear"]


@pytest.mark.parametrize("folder", ["$(rospack find osrf_gear)", "`catkin_find --share osrf_gear`"])
def test_gear_dry_run_prints_files_only(alone: Shell, tmp_path: Path, folder: str) -> None:
    script = f"rosrun osrf_gear gear.py -n -f {folder}/config/sample.yaml __log:=x"
    printed = alone.tool("bash", "-c", script)
    assert [line for line in printed.splitlines() if line.startswith("# file: ")] == [
        *("# file: config.yaml", "# file: gear.yaml", "# file: gear.urdf", "# file: gear.launch")
    ]
    assert not (tmp_path / ".ariac").exists()


def test_program_of_2017_works_trial_to_its_end(shell: Shell, tmp_path: Path) -> None:
    """A launch file starts the cell, an old shebang the program; with the trial the simulator ends."""
    launch = shell.launched(tmp_path, 'required="true"', exits=True)
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    assert "all went well\n" in shell.tool(str(program))
    assert launch.finish() == 0
    assert not launch.relatives()
    log = (tmp_path / ".ariac" / "log" / "performance.log").read_text()
    assert "<game_score>\nTotal game score: [0]\n" in log
    assert "<kit_score order_0_kit_0>\nTotal kit score: [0]\nComplete: [false]\nSubmitted: [true]\n" in log
    for output in (launch.out, launch.err):
        assert "Traceback" not in output


def test_written_launch_file_starts_same_cell(shell: Shell, tmp_path: Path) -> None:
    launch = shell.launched(tmp_path)
    assert (tmp_path / "out" / "config.yaml").is_file()
    launch.interrupt()
    assert not launch.relatives()
    again = shell.start("roslaunch", str(tmp_path / "out" / "gear.launch"))
    ready = again.wait_for(r"^ready: (\S+) ")
    assert ready[1] == "config"
    topics = shell.tool("rostopic", "list").split()
    assert "/ariac/logical_camera_over_agv1" in topics
    again.interrupt()
    assert not again.relatives()


def test_python_example_node_moves_arm_to_zero(shell: Shell, tmp_path: Path) -> None:
    """It is in the package beside the launcher, and moves the arm to zero."""
    launch = shell.launched(tmp_path)
    node = shell.start("rosrun", "ariac_example", "ariac_example_node.py")
    wait_until(lambda: "competition state: go" in node.out + node.err, "start of the competition")

    def position() -> list[float]:
        text = shell.tool("rostopic", "echo", "-n1", "/ariac/joint_states/position")
        return [float(number) for number in text.splitlines()[0].strip("[]()").split(",")]

    wait_until(lambda: max(map(abs, position())) < 0.1, "arm at zero")
    node.interrupt()
    launch.interrupt()


def test_launch_file_starts_robot_node(alone: Shell, tmp_path: Path) -> None:
    """The vendor's script and options, under the launch file's name."""
    assert alone.tool("rosmsg", "md5", "cellwright_msgs/TeleopStatus").strip() == TYPES.md5(
        "cellwright_msgs/TeleopStatus"
    )
    file = tmp_path / "robot.launch"
    file.write_text(ROBOT_LAUNCH)
    launch = alone.start("roslaunch", str(file))
    launch.wait_for(r"^ready: tandem at .* as /left_cell$")
    assert alone.tool("rosnode", "list").split() == ["/left_cell", "/rosout"]
    assert "success: True" in alone.tool("rosservice", "call", "/io_teleop_reset_robot")
    launch.interrupt()
    assert not launch.relatives()
    assert "Traceback" not in launch.said


def test_openloong_node_starts_qinglong(alone: Shell) -> None:
    unknown = alone.start("rosrun", IO_TELEOP, "general_sim_robot_control_node.py", "--robot_name", "Unknown")
    assert unknown.finish() == 2
    assert unknown.err == "error: unknown robot 'Unknown' (known: OpenLoong, tandem)\n"
    node = alone.start("rosrun", IO_TELEOP, "openloong_controller_node.py")
    node.wait_for("^ready: QingLong at .* as /openloong_controller_node$")
    assert "/io_teleop/target_joint_from_vr" in alone.tool("rostopic", "list").split()
    assert node.interrupt() == 0
    assert not node.relatives()


def test_ctrl_c_during_start_ends_gear_without_traceback(shell: Shell, tmp_path: Path) -> None:
    for later in (False, True):
        gear = shell.start("rosrun", "osrf_gear", "gear.py", "-o", str(tmp_path / "out"))
        if later:
            wait_until(lambda: (tmp_path / "out" / "gear.launch").exists(), "files")
        gear.interrupt()
        assert "Traceback" not in gear.out + gear.err
        assert not gear.relatives()


def test_gear_with_missing_file_prints_error(alone: Shell) -> None:
    gear = alone.start("rosrun", "osrf_gear", "gear.py", "-f", "/nowhere.yaml")
    assert gear.finish() == 1
    assert gear.err == "Error: /nowhere.yaml: cannot be read: No such file or directory\n"
