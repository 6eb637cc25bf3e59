"""Services of `simulation_interfaces`, with its action."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.middleware.ros2.packages.contents import definitions
from tests.ros2.ground import Ground, bridge_pid, ground
from tests.support.cells import INITIAL, JOINTS

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
        SpawnEntity,
        TagsFilter,
    )
    from simulation_interfaces.srv import SpawnEntities

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
        both = [SpawnEntity(initial_pose=PoseStamped(pose=pose)) for _ in range(2)]
        both[0].entity_resource.uri = "gear_part"
        both[1].entity_resource.uri = "anvil"
        spawned = me.call("/spawn_entities", "simulation_interfaces/SpawnEntities", spawn_requests=both)
        assert spawned.result.result == SpawnEntities.Response.ENTITIES_SPAWN_FAILED
        assert [each.result.result for each in spawned.results] == [Result.RESULT_OK, Result.RESULT_NOT_FOUND]
        found["SpawnEntities"] = True
        call("ResetSimulation", scope=2)
        assert spawned.results[0].entity_name in call("GetEntities").entities
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
    of_own_test = {"LoadWorld", "UnloadWorld"}
    assert services == set(found) - {"features"} | of_own_test
    assert len(found["features"]) == 31


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
    from rclpy_node import BEST_EFFORT, MANY, Node
    from simulation_interfaces.action import SimulateSteps
    from simulation_interfaces.msg import SimulationState

    with Node() as me:
        steps = me.action_client(
            "/simulate_steps", "simulation_interfaces/SimulateSteps", feedback_sub_qos_profile=MANY
        )
        refused = me.act(me.act(steps.send_goal_async, SimulateSteps.Goal(steps=10)).get_result_async)
        me.call("/set_simulation_state", "simulation_interfaces/SetSimulationState", state=SimulationState(state=2))
        counts: list[list[int]] = []
        clocks = me.listen("/clock", "rosgraph_msgs/Clock", BEST_EFFORT)

        def note(message: Any) -> None:
            counts.append([message.feedback.completed_steps, message.feedback.remaining_steps])

        goal = me.act(steps.send_goal_async, SimulateSteps.Goal(steps=120), note)
        # the result only then: once it has come, rclpy drops feedback that is still on its way
        me.wait(lambda: [120, 0] in counts, "last feedback")
        whole = me.act(goal.get_result_async)
        newest = me.call("/get_entity_state", "simulation_interfaces/GetEntityState", entity="arm").state.header.stamp
        me.wait(lambda: clocks and clocks[-1].clock == newest, "time of the last step")
        none = me.act(me.act(steps.send_goal_async, SimulateSteps.Goal(steps=0)).get_result_async)
        goal = me.act(steps.send_goal_async, SimulateSteps.Goal(steps=100_000))
        me.act(goal.cancel_goal_async)
        cancelled = me.act(goal.get_result_async)
        me.call("/set_simulation_state", "simulation_interfaces/SetSimulationState", state=SimulationState(state=1))
        return [[each.status, each.result.result.result] for each in (refused, whole, none, cancelled)] + counts


def test_steps_have_feedback_and_can_be_cancelled(cell: Ground) -> None:
    succeeded, canceled, aborted = 4, 5, 6
    assert cell.client(simulate_steps).value() == [
        *([aborted, 4], [succeeded, 1], [aborted, 4], [canceled, 1]),
        *([done, 120 - done] for done in range(1, 121)),
    ]


def hear_clock_while_paused() -> dict[str, Any]:
    """Step, reset and stop a paused cell; return the times of its answers and those that were heard."""
    from rclpy_node import BEST_EFFORT, Node
    from simulation_interfaces.msg import SimulationState

    def nanoseconds(stamp: Any) -> int:
        return int(stamp.sec * 10**9 + stamp.nanosec)

    package = "simulation_interfaces"
    with Node() as me:

        def request(service: str, kind: str, **fields: Any) -> None:
            result = me.call(service, f"{package}/{kind}", **fields).result
            assert result.result == 1, result.error_message

        def now() -> int:
            state = me.call("/get_entity_state", f"{package}/GetEntityState", entity="arm").state
            return nanoseconds(state.header.stamp)

        def hear_later_than(time: int) -> int:
            return int(me.wait(lambda: (now := nanoseconds(clocks[-1].clock)) > time and now, "next time"))

        def turn(state: int) -> None:
            request("/set_simulation_state", "SetSimulationState", state=SimulationState(state=state))

        turn(2)
        paused_at = now()
        clocks = me.listen("/clock", "rosgraph_msgs/Clock", BEST_EFFORT)
        heard = [me.wait(lambda: clocks and nanoseconds(clocks[-1].clock), "time while paused")]
        for _ in range(10):
            request("/step_simulation", "StepSimulation")  # its default is one step
            heard.append(hear_later_than(heard[-1]))
        stepped_to = now()
        request("/reset_simulation", "ResetSimulation", scope=1)
        me.wait(lambda: nanoseconds(clocks[-1].clock) == 0, "time 0 after a reset of the time")
        request("/step_simulation", "StepSimulation", steps=3)
        me.wait(lambda: nanoseconds(clocks[-1].clock) == now() > 0, "time of three steps")
        states = []
        for state in (1, 0, 1, 2, 0):
            turn(state)
            states.append(me.call("/get_simulation_state", f"{package}/GetSimulationState").state.state)
            if state == 0:
                me.wait(lambda: nanoseconds(clocks[-1].clock) == 0, "time 0 of a stopped simulation")
        turn(1)
        me.wait(lambda: nanoseconds(clocks[-1].clock) > 0, "time that passes")
        return {"paused_at": paused_at, "heard": heard, "stepped_to": stepped_to, "states": states}


def test_clock_moves_after_each_step_and_is_there_while_paused(cell: Ground) -> None:
    found = cell.client(hear_clock_while_paused).value()
    assert found["heard"] == [found["paused_at"] + step * 2_000_000 for step in range(11)]
    assert found["stepped_to"] == found["heard"][-1]
    assert found["states"] == [1, 0, 1, 2, 0]


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


def change_world(name: str, before: str) -> dict[str, Any]:
    """Load a world, unload it, and load the first one again; return what a program finds that stays."""
    from rclpy_node import BEST_EFFORT, Node
    from simulation_interfaces.msg import SimulationState

    package = "simulation_interfaces"
    with Node() as me:

        def ask(service: str, kind: str, **fields: Any) -> Any:
            return me.call(service, f"{package}/{kind}", timeout=1.0, **fields)

        def current() -> str:
            assert "cellwright" in me.node.get_node_names()
            answer = ask("/get_current_world", "GetCurrentWorld")
            return "" if answer is None else answer.world.name

        def load(uri: str) -> int:
            loaded = ask("/load_world", "LoadWorld", uri=uri)
            assert (loaded.result.result, loaded.world.name) == (1, uri), loaded.result.error_message
            me.wait(lambda: current() == uri, "other world")
            me.wait(lambda: clocks and clocks[-1].clock.sec == clocks[-1].clock.nanosec == 0, "time 0 of it")
            return int(ask("/get_simulation_state", "GetSimulationState").state.state)

        me.wait(lambda: "cellwright" in me.node.get_node_names(), "node")
        me.wait(lambda: current() == before, "first world")
        clocks = me.listen("/clock", "rosgraph_msgs/Clock", BEST_EFFORT)
        states = [load(name)]
        playing = ask("/set_simulation_state", "SetSimulationState", state=SimulationState(state=1)).result.result
        me.wait(lambda: clocks[-1].clock.nanosec > 0, "time of the other world")
        parameters = me.call("/cellwright/list_parameters", "rcl_interfaces/ListParameters").result.names
        entities = list(ask("/get_entities", "GetEntities").entities)
        unloaded = ask("/unload_world", "UnloadWorld").result.result
        states.append(int(ask("/get_simulation_state", "GetSimulationState").state.state))
        states.append(load(before))
        again = me.call("/cellwright/list_parameters", "rcl_interfaces/ListParameters").result.names
        return {
            "states": states,
            "results": [playing, unloaded],
            "has_arm": ["arm" in entities, "arm" in ask("/get_entities", "GetEntities").entities],
            "arm_parameters": [sum(each.startswith("ariac.arm.") for each in names) for names in (parameters, again)],
        }


def test_other_trial_is_loaded_as_world_and_the_node_stays(tmp_path: Path) -> None:
    stopped, no_world = 0, 4
    with ground(tmp_path) as made:
        served = made.serve("lesson", "-d")
        bridge = bridge_pid(served)
        found = made.client(change_world, "final01", "lesson").value()
        assert found["states"] == [stopped, no_world, stopped]
        assert found["results"] == [1, 1]
        assert found["has_arm"] == [False, True]
        without, with_arm = found["arm_parameters"]
        assert without < with_arm
        assert bridge_pid(served) == bridge
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
