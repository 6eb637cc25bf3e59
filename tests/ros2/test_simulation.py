"""Services of `simulation_interfaces`, with its action."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.middleware.ros2.packages.contents import definitions
from tests.cells import INITIAL, JOINTS
from tests.ros2.ground import Ground, ground

pytestmark = pytest.mark.ros2

GEAR = "bin8|gear_part_1"


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ground]:
    """The lesson in development mode."""
    with ground(tmp_path_factory.mktemp("simulation")) as made:
        made.serve("lesson", "-d")
        yield made


def use_each_service(gear: str) -> dict[str, Any]:
    """Arrange the cell as a test program does; return what was found."""
    from geometry_msgs.msg import Pose, PoseStamped
    from rclpy_node import Node
    from simulation_interfaces.msg import (
        EntityCategory,
        EntityFilters,
        EntityInfo,
        EntityState,
        Result,
        SimulationState,
        TagsFilter,
    )

    found: dict[str, Any] = {}
    with Node() as me:

        def call(kind: str, /, **fields: Any) -> Any:
            words = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in kind)[1:]
            response = me.call(f"/{words}", f"simulation_interfaces/{kind}", **fields)
            if hasattr(response, "result"):
                assert response.result.result == Result.RESULT_OK, (kind, response.result.error_message)
            found[kind] = True
            return response

        features = call("GetSimulatorFeatures").features
        found["features"] = sorted(features.features)
        playing, paused = (SimulationState(state=state) for state in (1, 2))
        assert call("GetSimulationState").state.state == playing.state
        call("SetSimulationState", state=paused)
        assert call("GetSimulationState").state.state == paused.state
        call("StepSimulation", steps=5)
        names = call("GetEntities", filters=EntityFilters(filter="gear")).entities
        assert gear in names
        robots = EntityFilters(categories=[EntityCategory(category=EntityCategory.CATEGORY_ROBOT)])
        assert list(call("GetEntitiesStates", filters=robots).entities) == ["arm", "agv1", "agv2"]
        call("SetEntityInfo", entity=gear, info=EntityInfo(description="the first", tags=["mine"]))
        assert list(call("GetEntityInfo", entity=gear).info.tags) == ["mine"]
        tagged = EntityFilters(tags=TagsFilter(tags=["mine"]))
        assert list(call("GetEntities", filters=tagged).entities) == [gear]
        places = {each.name: each.pose for each in call("GetNamedPoses").poses}
        corners = call("GetNamedPoseBounds", name="bin7").bounds.points
        assert corners[0].z > corners[1].z
        state = EntityState(pose=places["kit_tray_1"])
        state.header.frame_id = "world"
        state.pose.position.z += 0.05
        call("SetEntityState", entity=gear, state=state)
        now = call("GetEntityState", entity=gear).state
        assert abs(now.pose.position.y - state.pose.position.y) < 1e-9
        upper, lower = call("GetEntityBounds", entity=gear).bounds.points
        assert 0.05 < upper.x - lower.x < 0.1
        assert [each.uri for each in call("GetSpawnables").spawnables] == ["gear_part"]
        pose = Pose(position=places["bin7"].position)
        pose.position.z += 0.1
        given = call("SpawnEntity", uri="gear_part", initial_pose=PoseStamped(pose=pose)).entity_name
        assert given in call("GetEntities").entities
        call("DeleteEntity", entity=given)
        assert call("GetCurrentWorld").world.name == "lesson"
        assert len(call("GetAvailableWorlds").worlds) > 20
        missing = me.call("/get_entity_info", "simulation_interfaces/GetEntityInfo", entity="nothing").result
        assert missing.result == Result.RESULT_NOT_FOUND
        assert "nothing" in missing.error_message
        call("ResetSimulation")
        assert list(call("GetEntityInfo", entity=gear).info.tags) == ["gear_part"]
        call("SetSimulationState", state=playing)
    return found


def test_program_uses_each_service(cell: Ground) -> None:
    found = cell.client(use_each_service, GEAR).value()
    services = {path[4:-4] for path in definitions()["simulation_interfaces"] if path.startswith("srv/")}
    of_own_test, not_offered = {"LoadWorld"}, {"SpawnEntities", "UnloadWorld"}
    assert services == set(found) - {"features"} | of_own_test | not_offered
    assert len(found["features"]) == 29


def reset_state(joints: list[str], far: list[float]) -> dict[str, Any]:
    """Reset the state alone, then move the arm at a stamped time; the node uses simulation time."""
    from rclpy.clock import JumpThreshold
    from rclpy.duration import Duration
    from rclpy.parameter import Parameter
    from rclpy_node import MANY, Node
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    def nanoseconds(stamp: Any) -> int:
        return int(stamp.sec * 10**9 + stamp.nanosec)

    with Node() as me:
        me.node.set_parameters([Parameter("use_sim_time", value=True)])
        clock = me.node.get_clock()
        jumps: list[Any] = []
        backward = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False)
        handle = clock.create_jump_callback(backward, post_callback=jumps.append)
        clocks = me.listen("/clock", "rosgraph_msgs/Clock", MANY)
        states = me.listen("/ariac/joint_states", "sensor_msgs/JointState", MANY)
        orders = me.listen("/ariac/orders", "osrf_gear/Order", MANY)
        arm = me.publisher("/ariac/arm/command", "trajectory_msgs/JointTrajectory")

        def begin() -> str:
            count = len(orders)
            assert me.call("/ariac/start_competition", "std_srvs/Trigger").success
            me.wait(lambda: len(orders) > count, "order")
            return str(orders[-1].order_id)

        me.wait(lambda: clocks and states and clock.now().nanoseconds > 0, "time")
        first = begin()
        answer = me.call("/reset_simulation", "simulation_interfaces/ResetSimulation", scope=2).result
        reset_at = clock.now().nanoseconds
        again = begin()
        start = clock.now().nanoseconds + 500_000_000
        command = JointTrajectory(joint_names=joints, points=[JointTrajectoryPoint(positions=far)])
        command.header.stamp.sec, command.header.stamp.nanosec = divmod(start, 10**9)
        command.points[0].time_from_start.nanosec = 500_000_000
        arm.publish(command)
        rail = states[-1].name.index(joints[0])
        me.wait(lambda: abs(states[-1].position[rail] - far[0]) < 0.01, "end of the motion")
        handle.unregister()
        moving = [each for each in states if nanoseconds(each.header.stamp) > reset_at]
        moving = [each for each in moving if abs(each.position[rail]) > 0.01]
        return {
            "answer": [answer.result, answer.error_message],
            "orders": [first, again],
            "jumps": len(jumps),
            "clock": [nanoseconds(each.clock) for each in clocks],
            "stamps": [nanoseconds(each.header.stamp) for each in states],
            "reset_at": reset_at,
            "delay": nanoseconds(moving[0].header.stamp) - start,
        }


def test_time_goes_on_over_reset_of_state(cell: Ground) -> None:
    found = cell.client(reset_state, list(JOINTS), [0.3, *INITIAL[1:]]).value()
    assert found["answer"] == [1, ""]
    assert found["orders"] == ["order_0", "order_0"]
    assert found["jumps"] == 0
    for times in (found["clock"], found["stamps"]):
        assert times == sorted(times)
        assert times[0] < found["reset_at"] < times[-1]
    assert 0 < found["delay"] < 500_000_000


def step_over_reset() -> list[Any]:
    """Step in lockstep before and after a reset of the state; return the times of the steps."""
    from builtin_interfaces.msg import Duration
    from rclpy_node import Node

    with Node() as me:

        def step() -> int:
            answer = me.call("/cellwright/step", "cellwright_msgs/Step", duration=Duration(nanosec=100_000_000))
            assert answer.success, answer.message
            return int(answer.time.sec * 10**9 + answer.time.nanosec)

        before = step()
        reset = me.call("/reset_simulation", "simulation_interfaces/ResetSimulation", scope=2)
        assert reset.result.result == 1, reset.result.error_message
        return [before, step(), step()]


def test_steps_of_lockstep_count_on_over_reset_of_state(tmp_path: Path) -> None:
    with ground(tmp_path) as made:
        made.serve("lesson", "-d", "--lockstep")
        assert made.client(step_over_reset).value() == [100_000_000, 200_000_000, 300_000_000]


def simulate_steps() -> list[Any]:
    """Step a paused cell over the action, once to the end and once until a cancel."""
    from rclpy_node import Node
    from simulation_interfaces.action import SimulateSteps
    from simulation_interfaces.msg import SimulationState

    with Node() as me:
        steps = me.action_client("/simulate_steps", "simulation_interfaces/SimulateSteps")
        refused = me.act(me.act(steps.send_goal_async, SimulateSteps.Goal(steps=10)).get_result_async)
        me.call("/set_simulation_state", "simulation_interfaces/SetSimulationState", state=SimulationState(state=2))
        counts: list[list[int]] = []

        def note(message: Any) -> None:
            counts.append([message.feedback.completed_steps, message.feedback.remaining_steps])

        goal = me.act(steps.send_goal_async, SimulateSteps.Goal(steps=120), note)
        whole = me.act(goal.get_result_async)
        me.wait(lambda: [120, 0] in counts, "last feedback")
        goal = me.act(steps.send_goal_async, SimulateSteps.Goal(steps=100_000))
        me.act(goal.cancel_goal_async)
        cancelled = me.act(goal.get_result_async)
        me.call("/set_simulation_state", "simulation_interfaces/SetSimulationState", state=SimulationState(state=1))
        return [[each.status, each.result.result.result] for each in (refused, whole, cancelled)] + counts


def test_steps_have_feedback_and_can_be_cancelled(cell: Ground) -> None:
    succeeded, canceled, aborted = 4, 5, 6
    assert cell.client(simulate_steps).value() == [
        *([aborted, 3], [succeeded, 1], [canceled, 1]),
        *([50, 70], [100, 20], [120, 0]),
    ]


def call_in_burst(count: int) -> int:
    """Send calls without waiting for their answers; return the number of answers."""
    from rclpy.qos import QoSProfile
    from rclpy_node import Node, interface

    with Node() as me:
        kind = interface("simulation_interfaces/GetSimulationState", "srv")
        client = me.node.create_client(kind, "/get_simulation_state", qos_profile=QoSProfile(depth=1000))
        assert client.wait_for_service(60.0)
        calls = [client.call_async(kind.Request()) for _ in range(count)]
        me.wait(lambda: all(call.done() for call in calls), f"answers to all {count} calls")
        return sum(call.result().result.result for call in calls)


def test_calls_in_burst_are_all_answered(cell: Ground) -> None:
    assert cell.client(call_in_burst, 300).value() == 300


def load_world(name: str, before: str) -> list[Any]:
    """Load a world; return its name, and that of the world that the node has then."""
    from rclpy_node import Node

    with Node() as me:

        def current() -> str:
            answer = me.call("/get_current_world", "simulation_interfaces/GetCurrentWorld", timeout=1.0)
            return "" if answer is None else answer.world.name

        me.wait(lambda: current() == before, "first world")
        loaded = me.call("/load_world", "simulation_interfaces/LoadWorld", uri=name)
        assert loaded.result.result == 1, loaded.result.error_message
        after = me.wait(lambda: (found := current()) not in ("", before) and found, "other world")
        return [loaded.world.name, after]


def test_other_trial_is_loaded_as_world(tmp_path: Path) -> None:
    with ground(tmp_path) as made:
        served = made.serve("lesson", "-d")
        assert made.client(load_world, "final01", "lesson").value() == ["final01", "final01"]
        made.stop(served)
        assert served.finish() == 0


def ask_in_competition(gear: str) -> list[int]:
    """Return the codes of the standard's answers in a competition."""
    from rclpy_node import Node

    with Node() as me:
        return [
            me.call(f"/get_{name}", f"simulation_interfaces/Get{kind}", **fields).result.result
            for name, kind, fields in (
                ("named_poses", "NamedPoses", {}),
                ("entities", "Entities", {}),
                ("entity_state", "EntityState", {"entity": gear}),
            )
        ]


def test_competition_tells_no_poses_of_parts(cell: Ground) -> None:
    with ground(cell.folder / "competition") as other:
        other.serve("lesson")
        assert other.client(ask_in_competition, GEAR).value() == [1, 0, 0]
