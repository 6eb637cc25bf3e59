"""A policy drives a robot's node: its channels, its latency in ticks of 1/240 s, guards, stops, and its recording."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.clients.policies.agent import PolicyAgent
from cellwright.clients.policies.recorded import RecordedPolicy
from cellwright.clients.policies.report import TOPIC, ReportCheck, RequestReport, Rules, decode_report
from cellwright.clients.policies.robot_workplace import RobotWorkplace, robot_names
from cellwright.clients.policies.spec import PolicySpec
from cellwright.clients.policies.workplace import Workplace
from cellwright.config.robot.config import CameraConfig, RobotConfig
from cellwright.engine.loop import StopCondition
from cellwright.middleware.bus import ExternalInput, InputKind
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.standard import Bool
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.util.errors import RunEndedError
from tests.clients.operators.nodes import robot
from tests.clients.policies.test_agent import Scripted, spec

ROBOT = robot()
JOINTS = [f"{side}_{number}" for side in ("right", "left") for number in range(1, 7)]
EYE = CameraConfig(
    "front", {"name": "front", "img_width": 32, "img_height": 24, "pos_offset": [2, 0, 0.5], "target_offset": [0, 0, 0]}
)


class Drive:
    """A node with a policy at it, and all that came in."""

    def __init__(self, config: RobotConfig = ROBOT, **settings: Any) -> None:
        self.node = RobotNode(config, RobotSettings(sim_time=True, **settings))
        self.inputs: list[tuple[int, ExternalInput]] = []
        self.node.bus.on_input.append(lambda given: self.inputs.append((self.node.simulation.now, given)))

    def work(
        self, policy: Scripted | RecordedPolicy, given: PolicySpec, seconds: float = 1.0, at: Mapping[float, Any] = {}
    ) -> None:
        """Let a policy work; `at` has calls by simulation time [s]."""
        node, waiting = self.node, sorted(at.items())
        transport = InProcess(node, node="/policy", stop=StopCondition(round(seconds * 1e9)))

        def step() -> None:
            while waiting and node.simulation.time >= waiting[0][0]:
                waiting.pop(0)[1]()
            node.simulation.step()

        transport.step = step
        recorded = policy.rules if isinstance(policy, RecordedPolicy) else None
        agent = PolicyAgent(given, lambda _setting: policy, recorded)
        timestep = node.simulation.clock.timestep.as_integer_ratio()
        place: Workplace = RobotWorkplace(NodeClient(transport), node.config, timestep)
        with pytest.raises(RunEndedError):
            agent.work(place)

    def applied(self, joint: str) -> float:
        return float(self.node.commander.applied[self.node.commander.numbers[joint]])

    def measured(self, joint: str) -> float:
        return float(self.node.driver.read().positions[self.node.commander.numbers[joint]])

    def times_of(self, topic: str) -> list[int]:
        return [time for time, given in self.inputs if given.name == f"/io_teleop/{topic}"]

    @property
    def reports(self) -> list[str]:
        return [
            given.message.data for _, given in self.inputs if given.kind is InputKind.PUBLISH and given.name == TOPIC
        ]

    @property
    def requests(self) -> list[RequestReport]:
        return [each for each in map(decode_report, self.reports) if isinstance(each, RequestReport)]


def going(joint: int, target: float, length: int = 8) -> Callable[..., Sequence[Sequence[float]]]:
    """Return a policy that lets one channel go to a target, and leaves all others."""

    def infer(observation: Mapping[str, NDArray[np.float32]], _number: int) -> Sequence[Sequence[float]]:
        values = observation["state"].tolist()
        values[joint] = target
        return [values] * length

    return infer


def key_map(folder: Path, actions: str) -> str:
    file = folder / "map.yaml"
    file.write_text(f"rate: 20\nobservation: {{state: {{channels: all}}}}\nactions: [{actions}]\n")
    return str(file)


def test_channels_are_the_joints_and_how_far_each_gripper_is_closed() -> None:
    names = robot_names(ROBOT, (1, 240))
    assert names.space.names == (*JOINTS, "gripper_right", "gripper_left")
    assert (names.arms["left"], names.grippers_of_arms["left"]) == (JOINTS[6:], "gripper_left")
    policy = Scripted(going(12, 1.0))
    drive = Drive()
    drive.work(policy, spec())
    assert policy.asked[0]["state"] == pytest.approx([0.0, 0.6, -1.2, 0.0, 0.4, 0.0] * 2 + [0.0, 0.0], abs=1e-3)
    assert policy.asked[-1]["state"][12] == pytest.approx(1.0, abs=0.02)
    assert drive.measured("right_finger") == pytest.approx(0.04, abs=1e-3)
    assert drive.measured("left_finger") == pytest.approx(0.0, abs=1e-3)


def test_latency_is_exact_where_a_tick_is_no_whole_number_of_nanoseconds() -> None:
    drive = Drive()
    drive.work(Scripted(going(0, 0.5)), spec(latency="100ms", chunk=4), 2.0)
    first = drive.requests[0]
    assert (first.latency, first.ready, first.first, first.index) == (24, 24, 24, 2)
    rules = decode_report(drive.reports[0])
    assert isinstance(rules, Rules)
    assert (rules.period, rules.timestep) == (12, (1, 240))
    clock = drive.node.simulation.clock
    begun = clock.first_tick_at(rules.begin)
    sent = [clock.first_tick_at(time) - begun for time in drive.times_of("joint_cmd")]
    assert sent == list(range(24, 24 + 12 * len(sent), 12))
    assert all(0 <= each.observed - each.exposed["/io_teleop/joint_states"] < 3 for each in drive.requests)


def test_recorded_episode_replays_to_the_same_state() -> None:
    drive = Drive()
    drive.work(Scripted(going(3, 0.7), [0.1, 0.02, 0.25]), spec(latency="measured", chunk=4))
    again = Drive()
    again.work(RecordedPolicy.of(drive.reports, "run.mcap"), PolicySpec("run.jsonl"))
    assert again.node.simulation.state_hash() == drive.node.simulation.state_hash()
    assert [each.latency for each in again.requests] == [each.latency for each in drive.requests]
    check = ReportCheck()
    for text in drive.reports:
        check.take(text)
    assert (check.fault, check.requests) == ("", len(drive.requests))


def test_guards_bound_what_is_asked_and_the_bounded_target_is_applied() -> None:
    free, guarded = Drive(), Drive(safety=SafetySettings(max_speeds=(("*", 0.5),)))
    for drive in (free, guarded):
        drive.work(Scripted(going(0, 1.5)), spec(), 1.0)
    assert free.applied("right_1") == pytest.approx(1.5)
    assert guarded.applied("right_1") == pytest.approx(0.5, abs=0.1)  # 0.5 rad/s


@pytest.mark.parametrize("holds_by", ["emergency stop", "way home"])
def test_steps_go_on_from_where_the_robot_is_after_it_took_no_commands(holds_by: str, tmp_path: Path) -> None:
    drive = Drive()
    bus, seen = drive.node.bus, []

    def look() -> None:
        seen.append(drive.applied("right_1"))

    begin = {
        "emergency stop": lambda: bus.publish("/io_teleop/emergency_stop", Bool(True)),
        "way home": lambda: bus.call("/io_teleop_reset_robot", TriggerRequest()),
    }[holds_by]
    at = {0.9: look, 1.0: begin, 2.5: look, 2.6: lambda: None, 3.0: look}
    if holds_by == "emergency stop":
        at[2.6] = lambda: bus.call("/io_teleop/clear_emergency_stop", TriggerRequest())
    given = spec(map_file=key_map(tmp_path, "{channels: [right_1], mode: delta, scale: 0.02}"))
    drive.work(Scripted(lambda _observation, _number: [[1.0]] * 4), given, 3.1, at)
    before, held, after = seen
    assert before > 0.3
    if holds_by == "way home":
        assert drive.node.commander.why_ignored == ""
        assert held < 0.7  # from home on; without a way home it would be at 1.0
    assert held < after + 1e-9 < held + 0.4


def test_joints_that_the_map_leaves_out_are_left_to_others(tmp_path: Path) -> None:
    drive = Drive()
    given = spec(map_file=key_map(tmp_path, "{channels: {arm: right}}, {gripper: right, open: 1, closed: 0}"))

    def other() -> None:
        drive.node.bus.publish("/io_teleop/joint_cmd", joint_state(["left_1"], [0.4], time=0), node="/op")

    drive.work(Scripted(lambda _observation, _number: [[0.2] * 6 + [0.5]] * 4), given, 1.0, {0.3: other})
    assert drive.measured("left_1") == pytest.approx(0.4, abs=0.01)
    assert drive.measured("right_1") == pytest.approx(0.2, abs=0.01)
    assert drive.measured("right_finger") == pytest.approx(0.02, abs=1e-3)


def test_tip_goes_to_a_pose(tmp_path: Path) -> None:
    drive = Drive()
    given = spec(map_file=key_map(tmp_path, "{pose: left, rotation: none, frame: world}"))
    x, y, z = drive.node.link_pose("left_tip").position
    goal = [x - 0.05, y + 0.04, z + 0.03]
    drive.work(Scripted(lambda _observation, _number: [goal] * 4), given, 2.0)
    assert drive.node.link_pose("left_tip").position == pytest.approx(goal, abs=2e-3)


def test_disabled_node_is_waited_for() -> None:
    drive = Drive(safety=SafetySettings(start_disabled=True))
    policy = Scripted(going(0, 0.5))
    drive.work(policy, spec(), 0.5)
    assert (policy.asked, drive.times_of("joint_cmd")) == ([], [])


@pytest.mark.slow
def test_pictures_of_the_robots_cameras_are_observed() -> None:
    drive = Drive(replace(ROBOT, cameras=(EYE,)))
    with closing(drive.node):
        policy = Scripted(going(0, 0.5))
        drive.work(policy, spec(), 0.4)
        picture = policy.asked[0]["images"]["front"]  # type: ignore[call-overload]
        assert picture.shape == (224, 224, 3)
        assert np.ptp(picture.astype(int)) > 30
        assert "/io_teleop/camera_front" in drive.requests[0].exposed
