"""Arm motions of the finals' teams: it arrives at its goals, and picks from each bin and from the belt.

One rospy program in their style waits until every joint is within 9 mm or 9 mrad of its goal.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import grip_pose
from cellwright.clients.agents.kitter.ur10_on_rail import folded, near_posture, station_posture
from cellwright.clients.agents.lesson import BY_BELT, OFF_BELT, ON_BELT, WAYPOINTS
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.ur10 import INITIAL_POSITIONS
from cellwright.motion import Joints, tool_down
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import ARM
from tests.ros1.ground import Ground
from tests.support.places import BIN_CENTRES, BIN_SURFACE
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = [pytest.mark.ros1, pytest.mark.slow]

TRIAL = """\
options: {insert_models_over_bins: true, insert_agvs: false, belt_population_cycles: 30}
models_over_bins: {%s}
belt_parts: {gear_part: {6.0: {pose: {xyz: [0, 0, 0.1], rpy: [0, 0, 0]}}}}
orders:
  order_0: {announcement_condition: time, announcement_condition_value: 0, parts: {one: {type: gear_part, pose: {}}}}
time_limit: -1
arm: {type: ur10}
sensors: {break_beam: {type: break_beam, pose: {xyz: [1.6, 2.25, 0.91], rpy: [0, 0, pi]}}}
"""
BINS = {name: centre for name, centre in BIN_CENTRES.items() if centre[0] > -0.5}
"""Bins that the arm reaches with its tool upright: the farther row is 1.3 m from its shoulder, the arm 1.18 m long."""

ONE_GEAR = "xyz_start: [0.3, 0.3, 0], xyz_end: [0.3, 0.3, 0], rpy: [0, 0, 0], num_models_x: 1, num_models_y: 1"

BELT_DELAY = 0.4
"""Time [s] from a part's arrival in the beam to the arm's departure; 0.1 to 0.7 s succeed, too."""

INITIAL = [INITIAL_POSITIONS[name] for name in ARM_JOINTS]


def in_the_lessons_order(number: int) -> list[float]:
    """Return a waypoint of the lesson, in the controller's order."""
    elbow, rail, lift, pan, *wrists = WAYPOINTS[number][:7]
    return [rail, pan, lift, elbow, *wrists]


def goals_all_over_the_rail(count: int) -> list[list[float]]:
    """Return goals with the arm folded, so that it touches nothing on its way."""
    chance = random.Random(2017)
    found = []
    for _ in range(count):
        asked = [*INITIAL]
        asked[0], asked[1], asked[6] = chance.uniform(-2.05, 2.05), chance.uniform(2.5, 3.8), chance.uniform(-1.5, 1.5)
        goal = folded(asked, INITIAL)
        found.append([*goal[:2], *(value + chance.uniform(-0.08, 0.08) for value in goal[2:])])
    return found


def pick(x: float, y: float) -> dict[str, Any]:
    """Return the path to a gear in a bin: above it, down onto it, and up again."""
    x, y, grip = grip_pose(Catalogue().figures("gear_part"), Pose((x, y, BIN_SURFACE)), 0, 0.0).position
    rail = ARM.rail_beside(x, y)
    above = station_posture(tool_down(x, y, 0.95), rail, INITIAL)
    assert above is not None
    down: list[Joints] = [above]
    for height in (0.90, 0.85, 0.80, grip + 0.02, grip + 0.005, grip - 0.004):
        goal = near_posture(tool_down(x, y, height), rail, down[-1])
        assert goal is not None
        down.append(goal)
    return {"over": [folded(above, INITIAL), list(above)], "down": [list(each) for each in down[1:]]}


def program(goals: list[list[float]], picks: dict[str, Any], belt: dict[str, Any]) -> dict[str, Any]:
    import rospy
    from osrf_gear.msg import Proximity, VacuumGripperState
    from osrf_gear.srv import VacuumGripperControl
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    names = [
        "linear_arm_actuator_joint", "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
        "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
    ]  # fmt: skip
    rospy.init_node("team")
    states: list[Any] = []
    seen: dict[str, Any] = {"attached": False, "beam": None}
    rospy.Subscriber("/ariac/joint_states", JointState, states.append)
    rospy.Subscriber("/ariac/gripper/state", VacuumGripperState, lambda m: seen.update(attached=m.attached))
    # The time at which a part came into the beam, None while there is none.
    rospy.Subscriber(
        "/ariac/break_beam_change", Proximity, lambda m: seen.update(beam=m.header.stamp if m.object_detected else None)
    )
    publisher = rospy.Publisher("/ariac/arm/command", JointTrajectory, queue_size=10)
    gripper = rospy.ServiceProxy("/ariac/gripper/control", VacuumGripperControl)
    start = rospy.ServiceProxy("/ariac/start_competition", Trigger)
    start.wait_for_service()
    wait_until(lambda: states and publisher.get_num_connections(), "joint states, and a listener to commands")

    def until(condition: Callable[[], object], seconds: float) -> bool:
        """Wait for some simulation time [s]; return whether the condition became true."""
        end = rospy.Time.now() + rospy.Duration(seconds)
        while not condition():
            if rospy.Time.now() > end:
                return bool(condition())
            rospy.sleep(0.01)
        return True

    def send(waypoints: Sequence[Any], times: list[float], start: Any = None) -> tuple[float, dict[str, float]]:
        """Send the arm along waypoints; return the expected time of arrival, and the last goal.

        Its times count from `start`, or else from the message's arrival.
        """
        message = JointTrajectory(joint_names=names)
        if start is not None:
            message.header.stamp = start
        for positions, seconds in zip(waypoints, times):  # noqa: B905 - as of Python 3.8
            message.points.append(JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(seconds)))
        del states[:]
        publisher.publish(message)
        return rospy.Time.now().to_sec() + times[-1], dict(zip(names, waypoints[-1]))  # noqa: B905

    def off(state: Any, goal: dict[str, float]) -> float:
        return float(max(abs(state.position[state.name.index(name)] - value) for name, value in goal.items()))

    def arrive(end: float, goal: dict[str, float], within: float = 3.0) -> float | None:
        """Return the delay until all joints were within 9 mm or 9 mrad [s]; None if they never were."""

        def late() -> float | None:
            for state in tuple(states):
                after = state.header.stamp.to_sec() - end
                if 0.0 <= after <= within and off(state, goal) < 0.009:
                    return float(after)
            return None

        until(lambda: late() is not None or (states and states[-1].header.stamp.to_sec() > end + within), 60.0)
        return late()

    def go(waypoints: Sequence[Any], times: list[float]) -> None:
        end, goal = send(waypoints, times)
        until(
            lambda: states and states[-1].header.stamp.to_sec() >= end and off(states[-1], goal) < 0.009,
            times[-1] + 3.0,
        )

    late, last = [], None
    for goal in goals:
        far = 2.0 if last is None else max(1.0, abs(goal[0] - last[0]))
        late.append(arrive(*send([goal], [far])))
        last = goal
    start()
    held = {}
    for name, way in picks.items():
        go(way["over"], [3.5, 5.0])
        gripper(True)
        send(way["down"], [0.3, 0.6, 0.9, 1.2, 1.5, 1.8])
        took = until(lambda: seen["attached"], 4.0)
        go([way["down"][0], way["over"][1], way["over"][0]], [1.0, 1.5, 2.5])
        held[name] = took and seen["attached"]
        gripper(False)
        until(lambda: not seen["attached"], 1.0)
    go([belt["by"]], [4.0])
    taken = False
    for _ in range(3):
        until(lambda: not seen["beam"], 10.0)
        gripper(True)
        until(lambda: seen["beam"], 20.0)
        # Timed by the beam, so that the program's own delay, times the speed of the run, does not count.
        send([belt["on"]], [1.0], seen["beam"] + rospy.Duration(belt["delay"]))
        taken = until(lambda: seen["attached"], belt["delay"] + 1.6)
        go([belt["off"] if taken else belt["by"]], [1.0])
        if taken:
            break
    return {"late": late, "held": held, "belt": taken and seen["attached"]}


def test_arm_reaches_goals_and_picks_parts(master: Ground) -> None:
    master.folder.joinpath("goals.yaml").write_text(
        TRIAL % ", ".join(f"{name}: {{models: {{gear_part: {{{ONE_GEAR}}}}}}}" for name in BINS)
    )
    master.serve(str(master.folder / "goals.yaml"), "--speed", "8")
    on = in_the_lessons_order(ON_BELT)
    on[2] = -0.66
    belt = {"by": in_the_lessons_order(BY_BELT), "on": on, "off": in_the_lessons_order(OFF_BELT), "delay": BELT_DELAY}
    picks = {name: pick(x, y) for name, (x, y) in BINS.items()}
    found = master.client(program, goals_all_over_the_rail(50), picks, belt).value()
    assert None not in found["late"], found["late"]
    assert max(found["late"]) < 3.0
    assert found["held"] == dict.fromkeys(BINS, True)
    assert found["belt"]
