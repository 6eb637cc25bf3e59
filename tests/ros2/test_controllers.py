"""Controllers of a cell for ros2_control's tools: also on a paused cell, after resets, and in a namespace."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from cellwright.cell.controllers import TYPES
from tests.ros2.ground import Ground, ground
from tests.support.cells import INITIAL, JOINTS
from tests.support.processes import Process

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

SUCCEEDED = 4
"""Code of action_msgs/GoalStatus."""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Ground, Process]]:
    """The lesson in development mode, and its process."""
    with ground(tmp_path_factory.mktemp("controllers")) as made:
        yield made, made.serve("lesson", "-d")


@pytest.fixture
def cell(served: tuple[Ground, Process]) -> Ground:
    """The lesson in development mode."""
    return served[0]


def set_state(state: int) -> int:
    """Pause the cell (2), or let it go on (1); return the result's code."""
    from rclpy_node import Node
    from simulation_interfaces.msg import SimulationState

    with Node() as me:
        kind = "simulation_interfaces/SetSimulationState"
        answer = me.call("/set_simulation_state", kind, state=SimulationState(state=state))
        return int(answer.result.result)


def spawn_all(manager: str) -> list[int]:
    """Run the spawner for each, for both, for both as a group, and for an unknown one; return its exit statuses."""
    from control_tools import spawn

    both = ("joint_state_broadcaster", "arm_controller")
    return [
        spawn(both[0], manager=manager),
        spawn(*both, manager=manager),
        spawn(*both, manager=manager, as_group=True),
        spawn("mine", manager=manager),
    ]


def use_tools() -> dict[str, Any]:
    """Use the command line and the plugin of rqt."""
    from control_tools import use_command_line, watch_manager

    return {"cli": use_command_line(), "rqt": watch_manager()}


def check_tools(found: dict[str, Any]) -> None:
    active = dict.fromkeys(TYPES, "active")
    assert found["rqt"] == {
        "table": active,
        "types": TYPES,
        "set": [False],
        "activity": [[name, "active"] for name in (*TYPES, "arm")],
    }
    refused = ("load another", "cleanup_controller", "unload_controller", "reload_controller_libraries")
    assert found["cli"] == {
        "list_controllers": active,
        "list_controller_types": list(TYPES.values()),
        "list_hardware_components": {"arm": [3, "active"]},
        "list_hardware_interfaces": [7, 21],
        "load_controller": True,
        **dict.fromkeys(refused, False),
        "switch_controllers": [False, "arm_controller is always active in this cell"],
        "active": [True, "active"],
        "inactive": [False, "active"],
    }


def test_tools_end_on_paused_cell_and_running_one(cell: Ground) -> None:
    assert cell.client(set_state, 2).value() == 1
    assert cell.client(spawn_all, "/controller_manager").value() == [0, 0, 0, 1]
    check_tools(cell.client(use_tools).value())
    assert cell.client(set_state, 1).value() == 1
    assert cell.client(spawn_all, "/controller_manager").value() == [0, 0, 0, 1]


def jog_arm() -> object:
    """Use the plugin of rqt for trajectories."""
    from control_tools import jog

    return jog()


def test_plugin_of_rqt_finds_controller_and_moves_arm(cell: Ground) -> None:
    found = cell.client(jog_arm).value()
    assert found == {"joints": list(JOINTS), "limited": list(JOINTS), "factor": 1.0, "output": True}


def work_over_resets(joints: list[str], home: list[float]) -> dict[str, Any]:
    """Reset the cell in both ways; return how the tools, the controller and the joint states go on."""
    from control_msgs.action import FollowJointTrajectory
    from rclpy.parameter import Parameter
    from rclpy_node import MANY, Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    found: dict[str, Any] = {}
    with Node() as me:
        me.node.set_parameters([Parameter("use_sim_time", value=True)])
        states = me.listen("/joint_states", "sensor_msgs/JointState", MANY)
        client = me.action_client("/arm_controller/follow_joint_trajectory", "control_msgs/FollowJointTrajectory")
        me.wait(lambda: states, "joint states")
        for scope in (255, 2):
            reset = me.call("/reset_simulation", "simulation_interfaces/ResetSimulation", scope=scope)
            states.clear()
            listed = me.call("/controller_manager/list_controllers", "controller_manager_msgs/ListControllers")
            point = JointTrajectoryPoint(positions=[0.2, *home[1:]])
            point.time_from_start.nanosec = 500_000_000
            goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=joints, points=[point]))
            done = me.act(me.act(client.send_goal_async, goal).get_result_async)
            me.wait(lambda: states, "joint states after the reset")
            found[str(scope)] = [
                reset.result.result,
                [each.state for each in listed.controller],
                [done.status, done.result.error_code],
            ]
        names = [name for name, _ in me.node.get_node_names_and_namespaces()]
        found["nodes"] = [names.count(name) for name in ("cellwright", "controller_manager", "arm_controller")]
        client.destroy()
    return found


def test_controllers_and_nodes_go_on_over_resets(cell: Ground) -> None:
    found = cell.client(work_over_resets, list(JOINTS), INITIAL).value()
    expected = [1, ["active", "active"], [SUCCEEDED, 0]]
    assert found == {"255": expected, "2": expected, "nodes": [1, 1, 1]}


def read_states(count: int) -> dict[str, Any]:
    """Read joint states under both names, the clock, and the parameters of the arm's controller."""
    from rclpy_node import MANY, Node
    from sensor_msgs.msg import JointState

    def nanoseconds(stamp: Any) -> int:
        return int(stamp.sec * 10**9 + stamp.nanosec)

    with Node() as me:
        clocks = me.listen("/clock", "rosgraph_msgs/Clock", MANY)
        me.wait(lambda: clocks, "time")
        ages: list[int] = []
        found: list[Any] = []

        def note(message: Any) -> None:
            found.append(message)
            ages.append(abs(nanoseconds(clocks[-1].clock) - nanoseconds(message.header.stamp)))

        me.node.create_subscription(JointState, "/joint_states", note, 10)
        old = me.listen("/ariac/joint_states", "sensor_msgs/JointState")
        me.wait(lambda: len(found) >= count and old, "joint states")
        node = "/arm_controller"
        names = me.call(f"{node}/list_parameters", "rcl_interfaces/ListParameters").result.names
        wanted = ["joints", "command_interfaces", "state_interfaces"]
        values = me.call(f"{node}/get_parameters", "rcl_interfaces/GetParameters", names=wanted).values
        return {
            "frames": sorted({each.header.frame_id for each in found}),
            "frames of 2017": sorted({each.header.frame_id for each in old}),
            "lengths": sorted(
                {len(each) for one in found for each in (one.name, one.position, one.velocity, one.effort)}
            ),
            "ages": sorted(ages),
            "parameters": list(names),
            "values": [list(each.string_array_value) for each in values],
        }


def test_joint_states_are_recent_and_whole_and_have_frame_of_broadcaster(cell: Ground) -> None:
    found = cell.client(read_states, 100).value()
    assert (found["frames"], found["frames of 2017"]) == (["base_link"], [""])
    assert found["lengths"] == [8]
    assert found["ages"][len(found["ages"]) // 2] < 100_000_000
    assert found["values"] == [list(JOINTS), ["position"], ["position", "velocity"]]
    assert {"constraints.goal_time", "constraints.elbow_joint.goal"} <= set(found["parameters"])


def send_unusual_goals(joints: list[str], home: list[float]) -> dict[str, list[bool]]:
    """Send goals that end in motion or have efforts, under both names of the action; return which are accepted."""
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    found: dict[str, list[bool]] = {}
    with Node() as me:
        for name in ("/ariac/arm/follow_joint_trajectory", "/arm_controller/follow_joint_trajectory"):
            client = me.action_client(name, "control_msgs/FollowJointTrajectory")
            accepted = found[name] = []
            for more in ({"velocities": [0.1] * 7}, {"effort": [1.0] * 7}, {"velocities": [0.0] * 7}):
                point = JointTrajectoryPoint(positions=home, **more)
                point.time_from_start.nanosec = 200_000_000
                trajectory = JointTrajectory(joint_names=joints, points=[point])
                goal = me.act(client.send_goal_async, FollowJointTrajectory.Goal(trajectory=trajectory))
                accepted.append(bool(goal.accepted))
                if goal.accepted:
                    me.act(goal.get_result_async)
            client.destroy()
    return found


def test_goals_under_name_of_ros2_control_pass_its_checks(served: tuple[Ground, Process]) -> None:
    cell, process = served
    assert cell.client(send_unusual_goals, list(JOINTS), INITIAL).value() == {
        "/ariac/arm/follow_joint_trajectory": [True, True, True],
        "/arm_controller/follow_joint_trajectory": [False, False, True],
    }
    process.wait_for("refused /arm_controller/follow_joint_trajectory: its last point has velocities other than 0")
    process.wait_for("its points have efforts")


def test_manager_is_in_namespace_of_its_cell(domain: Ground) -> None:
    domain.serve("lesson", "-d", "--ros-args", "-r", "__ns:=/cell1")
    assert domain.client(spawn_all, "/cell1/controller_manager").value() == [0, 0, 0, 1]


def broadcast() -> dict[str, Any]:
    """Publish as a `joint_state_broadcaster` of one's own beside a robot; return the publishers of its topic."""
    from rclpy_node import Node
    from sensor_msgs.msg import JointState

    with Node("joint_state_broadcaster") as me:
        me.node.create_publisher(JointState, "/joint_states", 10)
        states = me.listen("/io_teleop/joint_states", "sensor_msgs/JointState")
        me.wait(lambda: states, "joint states")
        names = [name for name, _ in me.node.get_node_names_and_namespaces()]
        return {"publishers": me.node.count_publishers("/joint_states"), "managers": names.count("controller_manager")}


def test_robot_leaves_joint_states_to_broadcaster_with_names_of_2017(domain: Ground) -> None:
    domain.teleop("tandem", "--ros2-names", "2017")
    assert domain.client(broadcast).value() == {"publishers": 1, "managers": 0}
