"""MoveIt's calls in a cell: state monitor, controller manager, goals as it sends them, and its planning scene."""

import math
from pathlib import Path
from typing import Any

import pytest

from cellwright import load_trial
from cellwright.cell.model.build import build_world
from cellwright.cell.model.solids import solids
from cellwright.cell.planning import planned_arm
from cellwright.middleware.ros2.packages import contents
from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

SUCCEEDED = 4
"""Code of action_msgs/GoalStatus."""

GOAL_MARGIN, DURATION_SCALING = 0.5, 1.1
"""MoveIt stops a trajectory that lasts longer than its duration by this factor and this time [s]."""

RECENT = 1.0
"""MoveIt waits for a state that is at most this old [s], by its own clock."""

SCRIPT = Path(contents.__file__).parent / "data" / contents.MOVEIT / "scripts" / "planning_scene.py"


def plan_and_execute(moves: list[list[float]], limits: list[list[float]]) -> dict[str, Any]:
    """Do what MoveIt does before and while it executes; return what it got.

    Args:
        moves: way of each joint in each trajectory [rad; m], in the controller's order.
        limits: maximum velocities and accelerations.
    """
    from control_msgs.action import FollowJointTrajectory
    from rclpy.parameter import Parameter
    from rclpy_node import LATCHED, MANY, Node
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    MOVING = 0.05  # [rad/s; m/s]

    def profile(move: list[float]) -> tuple[float, list[list[list[float]]]]:
        """Return duration, and time, positions, velocities, accelerations of points 0.1 s apart, as fast as allowed."""
        share = [abs(way) for way in move]
        velocity = min(limit / way for limit, way in zip(limits[0], share, strict=True) if way)
        acceleration = min(limit / way for limit, way in zip(limits[1], share, strict=True) if way)
        velocity = min(velocity, acceleration**0.5)
        rise = velocity / acceleration
        duration = rise + 1.0 / velocity
        rows = []
        for number in range(int(duration / 0.1) + 2):
            now = min(0.1 * number, duration)
            if now < rise:
                s, v, a = acceleration * now**2 / 2, acceleration * now, acceleration
            elif now < duration - rise:
                s, v, a = velocity * (now - rise / 2), velocity, 0.0
            else:
                left = duration - now
                s, v, a = 1.0 - acceleration * left**2 / 2, acceleration * left, -acceleration
            rows.append([[now], *([each * way for way in move] for each in (s, v, a))])
        return duration, rows

    def seconds(stamp: Any) -> float:
        return float(stamp.sec + stamp.nanosec * 1e-9)

    with Node() as me:
        me.node.set_parameters([Parameter("use_sim_time", value=True)])
        description = me.listen("/robot_description", "std_msgs/String", LATCHED)
        clock = me.listen("/clock", "rosgraph_msgs/Clock", MANY)
        ages: list[float] = []
        states: list[Any] = []

        def take(state: Any) -> None:
            if now := me.node.get_clock().now().nanoseconds:  # 0 until it has heard /clock
                ages.append(abs(now * 1e-9 - seconds(state.header.stamp)))
                states.append(state)

        me.node.create_subscription(JointState, "/joint_states", take, 10)
        me.wait(lambda: description and len(states) > 20, "description and states")

        listed = me.call("/controller_manager/list_controllers", "controller_manager_msgs/ListControllers").controller
        (controller,) = [
            each for each in listed if each.type == "joint_trajectory_controller/JointTrajectoryController"
        ]
        joints = [each.split("/")[0] for each in controller.claimed_interfaces]
        required = [each.split("/")[0] for each in controller.required_command_interfaces]
        action = f"/{controller.name}/follow_joint_trajectory"
        client = me.action_client(action, "control_msgs/FollowJointTrajectory")
        results = []
        for move in moves:
            before = states[-1]
            present = [before.position[list(before.name).index(joint)] for joint in joints]
            duration, rows = profile(move)
            goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=joints))
            for (now,), way, velocities, accelerations in rows:
                point = JointTrajectoryPoint(velocities=velocities, accelerations=accelerations)
                point.positions = [start + part for start, part in zip(present, way, strict=True)]
                point.time_from_start.sec, point.time_from_start.nanosec = divmod(int(now * 1e9), 10**9)
                goal.trajectory.points.append(point)
            first = len(states)
            handle = me.act(client.send_goal_async, goal)
            answer = me.act(handle.get_result_async) if handle.accepted else None
            me.wait(lambda: max(map(abs, states[-1].velocity)) < MOVING, "arm at rest")
            moving = [each.header.stamp for each in states[first:] if max(map(abs, each.velocity)) > MOVING]
            lasted = seconds(moving[-1]) - seconds(moving[0])
            after = [states[-1].position[list(states[-1].name).index(joint)] for joint in joints]
            end = goal.trajectory.points[-1].positions
            left = max(abs(one - other) for one, other in zip(after, end, strict=True))
            code = answer.result.error_code if answer else None
            results.append([handle.accepted, answer and answer.status, code, duration, lasted, left])
        return {
            "description": description[0].data[:60],
            "joints": joints,
            "required": required,
            "state": controller.state,
            "age": sorted(ages)[len(ages) // 2],
            "off": max(
                min(abs(seconds(state.header.stamp) - seconds(each.clock)) for each in clock) for state in states[5:20]
            ),
            "lengths": [len(states[0].name), len(states[0].position), len(states[0].velocity), len(states[0].effort)],
            "names": list(states[0].name),
            "results": results,
        }


MOVES = [
    [0.4, 1.2, -0.3, 0.5, -0.6, 0.4, 1.5],
    [-0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.4, -1.2, 0.3, -0.5, 0.6, -0.4, -4.5],
]
"""Ways of the joints from the home posture that meet nothing."""


def test_goals_as_moveit_sends_them_succeed_at_full_speed_and_in_time(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    arm = planned_arm()
    limits = [[each[joint] for joint in arm.joints] for each in (arm.max_velocity, arm.max_acceleration)]
    found = domain.client(plan_and_execute, MOVES, limits).value()
    assert found["joints"] == found["required"] == list(arm.joints)
    assert found["state"] == "active"
    assert set(found["names"]) >= {*arm.joints, *arm.passive_joints}, "a state of all moving joints"
    assert len(set(found["lengths"])) == 1
    assert found["off"] < 0.1
    assert found["age"] < RECENT
    for accepted, status, code, duration, lasted, left in found["results"]:
        assert (accepted, status, code) == (True, SUCCEEDED, 0)
        assert 0.8 * duration < lasted < DURATION_SCALING * duration + GOAL_MARGIN
        assert left < 0.1, "the controller's tolerance"
    partial = domain.client(send_goal_of, arm.groups["arm"]).value()
    assert partial == [False, None], "the original allows none"


def send_goal_of(joints: list[str]) -> list[Any]:
    """Send a goal for these joints, to where they are; return whether it was accepted, and its status."""
    from control_msgs.action import FollowJointTrajectory
    from rclpy_node import Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    with Node() as me:
        states = me.listen("/joint_states", "sensor_msgs/JointState")
        client = me.action_client("/arm_controller/follow_joint_trajectory", "control_msgs/FollowJointTrajectory")
        me.wait(lambda: states, "states")
        present = [states[-1].position[list(states[-1].name).index(joint)] for joint in joints]
        goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=joints))
        for seconds in (0, 1):
            point = JointTrajectoryPoint(positions=present, velocities=[0.0] * len(joints))
            point.time_from_start.sec = seconds
            goal.trajectory.points.append(point)
        handle = me.act(client.send_goal_async, goal)
        status = me.act(handle.get_result_async).status if handle.accepted else None
        return [handle.accepted, status]


def test_group_without_rail_executes_where_partial_goals_are_allowed(domain: Ground) -> None:
    domain.serve("lesson", "-d", "--set", "cellwright.arm.allow_partial_joints_goal=true")
    assert domain.client(send_goal_of, planned_arm().groups["arm"]).value() == [True, SUCCEEDED]


def show_scene(script: str) -> dict[str, Any]:
    """Return the objects that the scene's program makes of a cell's solids, with stand-ins for MoveIt's messages."""
    import importlib.util
    import sys
    import types

    from geometry_msgs.msg import Pose
    from std_msgs.msg import Header

    def message(name: str, lists: str = "", **constants: Any) -> type:
        def start(self: Any, **fields: Any) -> None:
            self.header = Header()
            self.__dict__.update({each: [] for each in lists.split()} | constants | fields)

        return type(name, (), {"__init__": start, **constants})

    def scene(is_diff: bool) -> Any:
        return types.SimpleNamespace(
            is_diff=is_diff, robot_state=types.SimpleNamespace(), world=types.SimpleNamespace()
        )

    lists = "primitives primitive_poses meshes mesh_poses planes plane_poses"
    modules: dict[str, dict[str, Any]] = {
        "moveit_msgs.msg": {"CollisionObject": message("CollisionObject", lists, ADD=b"\0"), "PlanningScene": scene},
        "moveit_msgs.srv": {"ApplyPlanningScene": types.SimpleNamespace(Request=types.SimpleNamespace)},
        "shape_msgs.msg": {
            "SolidPrimitive": message("SolidPrimitive", BOX=1, SPHERE=2, CYLINDER=3),
            **{name: message(name) for name in ("Mesh", "MeshTriangle", "Plane")},
        },
    }
    for name, names in modules.items():
        sys.modules[name.partition(".")[0]] = types.ModuleType(name.partition(".")[0])
        sys.modules[name] = types.ModuleType(name)
        sys.modules[name].__dict__.update(names)
    described = importlib.util.spec_from_file_location("planning_scene", script)
    assert described is not None
    assert described.loader is not None
    program = importlib.util.module_from_spec(described)
    described.loader.exec_module(program)

    program.rclpy.init()
    node = program.SceneNode()
    solids, links = node.solids(), node.links()
    objects = program.collision_objects(solids, links)
    asked: list[Any] = []
    for is_taken in (True, False):

        def answer(kind: Any, name: str, request: Any, is_taken: bool = is_taken) -> Any:
            asked.append([name, request.scene.is_diff, request.scene.robot_state.is_diff])
            return types.SimpleNamespace(success=is_taken)

        node._call = answer
        try:
            node.apply(objects)
        except RuntimeError as error:
            asked.append(str(error))
    mesh = {"body": "sign", "type": "mesh", "size": [], "position": [0.0, 0.0, 1.0], "quaternion": [1.0, 0.0, 0.0, 0.0]}
    mesh |= {"vertices": [[0.0, 0.0, float(n)] for n in range(4)], "triangles": [[0, 1, 2], [0, 1, 3]]}
    (sign,) = program.collision_objects([mesh], links)
    try:
        program.collision_objects([mesh | {"type": "torus"}], links)
        refused = ""
    except RuntimeError as error:
        refused = str(error)
    node.close()
    program.rclpy.try_shutdown()

    def values(pose: Any) -> list[float]:
        assert isinstance(pose, Pose)
        return [pose.position.x, pose.position.y, pose.position.z, pose.orientation.w, pose.orientation.z]

    return {
        "links": sorted(links),
        "frames": sorted({each.header.frame_id for each in objects}),
        "objects": {
            each.id: [
                [shape.type, *shape.dimensions, *values(pose)]
                for shape, pose in zip(each.primitives, each.primitive_poses, strict=True)
            ]
            for each in objects
        },
        "floor": [list(each.coef) for made in objects if made.id == "floor" for each in made.planes],
        "sign": [len(sign.meshes[0].vertices), [list(each.vertex_indices) for each in sign.meshes[0].triangles]],
        "asked": asked,
        "refused": refused,
    }


def test_planning_scene_has_the_cells_solids_without_the_robot(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    found = domain.client(show_scene, str(SCRIPT)).value()
    objects = found["objects"]
    assert {"bin7", "conveyor_belt", "agv1", "floor"} <= set(objects)
    assert "linear_arm_actuator" in found["links"]
    assert set(objects).isdisjoint(found["links"])
    assert found["frames"] == ["world"]
    assert found["floor"] == [[0.0, 0.0, 1.0, 0.0]]
    solids = build_solids()
    assert set(objects) == {"floor" if each["body"] == "world" else each["body"] for each in solids} - {
        "linear_arm_actuator"
    }
    (belt,) = [each for each in solids if each["body"] == "conveyor_belt"]
    ((kind, *values),) = objects["conveyor_belt"]
    assert (kind, values[:3]) == (1, pytest.approx([2 * half for half in belt["size"]]))
    assert values[3:6] == pytest.approx(belt["position"])
    capsules = [each for each in solids if each["body"] == "bin7" and each["type"] == "capsule"]
    ends = [each for each in objects["bin7"] if each[0] == 2]
    tubes = [each for each in objects["bin7"] if each[0] == 3]
    assert (len(ends), len(tubes)) == (2 * len(capsules), len(capsules))
    for capsule, tube, low, high in zip(capsules, tubes, ends[::2], ends[1::2], strict=True):
        radius, half = capsule["size"]
        assert tube[1:3] == pytest.approx([2 * half, radius])
        assert math.dist(low[2:5], high[2:5]) == pytest.approx(2 * half)
        assert [(a + b) / 2 for a, b in zip(low[2:5], high[2:5], strict=True)] == pytest.approx(capsule["position"])
    assert found["sign"] == [4, [[0, 1, 2], [0, 1, 3]]]
    assert "unknown type of shape 'torus'" in found["refused"]
    *first, refusal = found["asked"]
    assert first == [["apply_planning_scene", True, True]] * 2
    assert refusal.startswith("apply_planning_scene: MoveIt refused the objects")


def build_solids() -> list[dict[str, Any]]:
    return solids(build_world(load_trial("lesson")))["world"]


def run_script(path: str) -> list[Any]:
    """Run a program; return its exit status and what it wrote to stderr."""
    import contextlib
    import io
    import runpy

    written = io.StringIO()
    with contextlib.redirect_stderr(written):
        try:
            runpy.run_path(path, run_name="__main__")
            status: Any = None
        except SystemExit as end:
            status = end.code
    return [status, written.getvalue()]


def test_planning_scene_without_moveit_names_what_to_install(domain: Ground) -> None:
    status, error = domain.client(run_script, str(SCRIPT)).value()
    assert status == 2
    assert error.startswith("planning_scene: No module named 'moveit_msgs'; install MoveIt and source it: apt-get")
