"""A policy works a cell: its latency is simulation time, whatever the wall clock does."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright import Cell, RunOptions, Trial
from cellwright.clients.policies.agent import PolicyAgent
from cellwright.clients.policies.policy import Answer, PolicyAnswerError, PolicyConnectionError
from cellwright.clients.policies.program import check_policy
from cellwright.clients.policies.recorded import RecordedPolicy
from cellwright.clients.policies.report import TOPIC, ReportCheck, RequestReport, Rules, decode_report
from cellwright.clients.policies.spec import PolicySpec
from cellwright.config.trial.trial import Part
from cellwright.middleware.bus import ExternalInput, InputKind
from cellwright.running.run import Outcome, RunResult, run_cell
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.support.cells import ARM_ONLY, BARE, order
from tests.support.places import BELT_SURFACE

CELL = replace(ARM_ONLY, orders=(order(),), time_limit=None)
Infer = Callable[[Mapping[str, NDArray[np.float32]], int], Sequence[Sequence[float]]]


class Scripted:
    """A policy that is a function of the observation and the number of the request."""

    metadata: Mapping[str, object] = {}

    def __init__(self, infer: Infer, walls: Sequence[float] = (0.0,)) -> None:
        self._infer, self._walls = infer, walls
        self.asked: list[Mapping[str, NDArray[np.float32]]] = []
        self.closed = 0

    def reset(self, seed: int, sentence: str) -> None:
        del seed, sentence
        self.asked.clear()

    def infer(self, observation: Mapping[str, object]) -> Answer:
        number = len(self.asked)
        self.asked.append(observation)  # type: ignore[arg-type]
        actions = np.array(self._infer(self.asked[-1], number), np.float64)
        return Answer(actions, b"reply", "request", self._walls[number % len(self._walls)])

    def close(self) -> None:
        self.closed += 1


def raising(observation: Mapping[str, NDArray[np.float32]], number: int) -> list[list[float]]:
    """Move the rail by 1 mm a period, and switch the suction at every other request."""
    state = observation["state"].tolist()
    return [[state[0] + 0.001 * step, *state[1:7], float(number % 2)] for step in range(1, 9)]


def run(policy: Scripted | RecordedPolicy, spec: PolicySpec, seconds: float = 1.0, trial: Trial = CELL) -> "Worked":
    cell = Cell(trial, seed=spec.seed)
    worked = Worked()

    def note(given: ExternalInput) -> None:
        worked.inputs.append((cell.simulation.now, given))
        if given.kind is InputKind.PUBLISH and given.name == TOPIC:
            worked.reports.append(given.message.data)

    cell.bus.on_input.append(note)
    recorded = policy.rules if isinstance(policy, RecordedPolicy) else None
    agent = PolicyAgent(spec, lambda _setting: policy, recorded)
    worked.result = run_cell(cell, agent, options=RunOptions(until=seconds))
    worked.summary = agent.summary
    return worked


class Worked:
    """A run with what came in, and the reports of its policy."""

    result: RunResult
    summary: str

    def __init__(self) -> None:
        self.inputs: list[tuple[int, ExternalInput]] = []
        self.reports: list[str] = []

    @property
    def requests(self) -> list[RequestReport]:
        return [each for each in map(decode_report, self.reports) if isinstance(each, RequestReport)]

    @property
    def rules(self) -> Rules:
        found = decode_report(self.reports[0])
        assert isinstance(found, Rules)
        return found

    def times_of(self, topic: str) -> list[int]:
        return [time for time, given in self.inputs if given.name == topic]


def spec(**options: object) -> PolicySpec:
    return PolicySpec.of("scripted", **options)  # type: ignore[arg-type]


class LooksBack(Scripted):
    """A policy that wants the observation of each control period."""

    def __init__(self, infer: Infer, history: int) -> None:
        super().__init__(infer)
        self.history, self.seen = history, 0

    def see(self, observation: Mapping[str, object]) -> None:
        assert observation.keys() == {"state", "prompt"}
        self.seen += 1


@pytest.mark.parametrize("history", [0, 2])
def test_policy_that_looks_back_sees_each_period_without_a_request(history: int) -> None:
    policy = LooksBack(raising, history)
    run(policy, spec(chunk=4))
    assert (len(policy.asked), policy.seen) == (5, 15 if history else 0)


def test_no_latency_is_the_same_run_as_a_world_that_stands() -> None:
    frozen, none = run(Scripted(raising), spec(chunk=8)), run(Scripted(raising), spec(latency="0ms", chunk=8))
    assert frozen.result.state_hash == none.result.state_hash
    assert len(frozen.requests) == 3


def test_latency_counts_in_ticks_and_delays_the_action() -> None:
    worked = run(Scripted(raising), spec(latency="120ms", chunk=4))
    first = worked.requests[0]
    assert (first.latency, first.ready, first.first, first.index) == (60, 60, 75, 3)
    assert worked.times_of("/ariac/arm/command")[0] == worked.rules.begin + 150_000_000


@pytest.mark.parametrize(("mode", "is_late"), [("async", True), ("sync", False)])
def test_summary_says_if_each_answer_is_older_than_its_actions(mode: str, is_late: bool) -> None:
    worked = run(Scripted(lambda _, __: [[0.0] * 8]), spec(latency="120ms", mode=mode))
    assert ("no action came in time" in worked.summary) == is_late


@pytest.mark.parametrize("options", [{}, {"latency": "uniform:60ms..180ms"}, {"latency": "120ms", "mode": "sync"}])
def test_wall_time_of_an_answer_changes_nothing(options: dict[str, str]) -> None:
    fast, slow = run(Scripted(raising), spec(**options)), run(Scripted(raising, [2.0, 0.3]), spec(**options))
    assert fast.result.state_hash == slow.result.state_hash


def test_measured_latency_is_that_of_each_answer_after_the_warm_up() -> None:
    policy = Scripted(raising, [0.1, 0.02])
    worked = run(policy, spec(latency="measured", chunk=4))
    assert [each.latency for each in worked.requests[:4]] == [50, 10, 50, 10]
    assert len(policy.asked) == len(worked.requests)  # the warm-up was before `reset`


def test_recorded_episode_replays_without_its_policy_and_a_changed_latency_shows() -> None:
    worked = run(Scripted(raising, [0.1, 0.02, 0.25]), spec(latency="measured", chunk=4))
    again = run(RecordedPolicy.of(worked.reports, "run.mcap"), PolicySpec("run.jsonl"))
    assert again.result.state_hash == worked.result.state_hash
    assert [each.latency for each in again.requests] == [each.latency for each in worked.requests]
    check = ReportCheck()
    for text in worked.reports:
        check.take(text)
    assert (check.fault, check.requests) == ("", len(worked.requests))
    document = json.loads(worked.reports[3])
    document["request"]["latency"] += 1
    for text in [*worked.reports[:3], json.dumps(document), *worked.reports[4:]]:
        check.take(text)
    assert check.fault.startswith("request 2: ready must be")


def test_recorded_episode_stops_where_the_observation_differs() -> None:
    worked = run(Scripted(raising), spec())
    other = replace(CELL, initial_joint_states={"elbow_joint": 1.0})
    again = run(RecordedPolicy.of(worked.reports, "run.mcap"), PolicySpec("run.jsonl"), trial=other)
    assert again.result.outcome is Outcome.INFRASTRUCTURE
    assert "request 0: the observation is not the recorded one" in again.result.error


@pytest.mark.parametrize("error", [PolicyConnectionError("ws://x: the connection is lost"), PolicyAnswerError("NaN")])
def test_fault_of_the_server_is_no_verdict_on_the_policy(error: Exception) -> None:
    def fail(observation: Mapping[str, NDArray[np.float32]], number: int) -> Sequence[Sequence[float]]:
        if number == 2:
            raise error
        return raising(observation, number)

    policy = Scripted(fail)
    worked = run(policy, spec(chunk=4))
    assert (worked.result.outcome, worked.result.error) == (Outcome.INFRASTRUCTURE, f"{error}\n")
    assert policy.closed == 1


def test_wrong_count_of_numbers_names_the_request() -> None:
    worked = run(Scripted(lambda _observation, _number: [[0.0] * 7]), spec())
    assert worked.result.outcome is Outcome.INFRASTRUCTURE
    assert "request 0: an action must have 8 numbers (got 7)" in worked.result.error


def test_holding_sends_nothing_and_steps_do_not_move_the_arm(tmp_path: Path) -> None:
    key_map = tmp_path / "map.yaml"
    key_map.write_text(
        "observation: {state: {channels: all}}\n"
        "actions: [{channels: [linear_arm_actuator_joint], mode: delta, scale: 0.001}]\n"
    )
    options = {"map_file": str(key_map), "latency": "200ms", "mode": "sync", "chunk": 2}
    policy = Scripted(lambda _observation, _number: [[1.0]] * 4)
    worked = run(policy, spec(**options), 2.0)
    begin = worked.rules.begin
    instants = [round((time - begin) / 50_000_000) for time in worked.times_of("/ariac/arm/command")]
    assert instants[:6] == [4, 5, 10, 11, 16, 17]  # 200 ms after each observation, two actions each
    rail = [float(each["state"][0]) for each in policy.asked]
    assert np.diff(rail)[1:] == pytest.approx(0.002, abs=2e-4)


def test_second_run_is_the_first_again() -> None:
    policy = Scripted(raising)
    first = run(policy, spec(latency="70ms"))
    second = run(policy, spec(latency="70ms"))
    assert first.reports == second.reports


def test_seed_of_the_run_draws_the_latencies() -> None:
    def latencies(seed: int) -> list[int]:
        worked = run(Scripted(raising), replace(spec(latency="uniform:60ms..180ms"), seed=seed))
        return [each.latency for each in worked.requests]

    assert latencies(3) == latencies(3)
    assert latencies(3) != latencies(4)


def test_observation_has_all_channels_and_the_time_of_each_part() -> None:
    policy = Scripted(raising)
    worked = run(policy, spec())
    state = policy.asked[0]["state"]
    assert state.dtype == np.float32
    assert state.shape == (8,)
    assert state[:7] == pytest.approx((0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0), abs=0.01)
    ages = [each.observed - each.exposed["/ariac/joint_states"] for each in worked.requests]
    assert all(0 <= age < 10 for age in ages)  # joint states come every 10 ticks


def test_cell_without_an_arm_is_refused() -> None:
    with pytest.raises(UsageError, match="bare: there is no arm and no robot for a policy to command"):
        check_policy(spec().words, BARE)


def test_policy_of_groot_needs_names_of_its_own(tmp_path: Path) -> None:
    address = "tcp://127.0.0.1:5555"
    with pytest.raises(UsageError, match=r"names of their own for what they see; add --policy-map"):
        check_policy(PolicySpec.of(address).words, CELL)
    file = tmp_path / "map.yaml"
    file.write_text("observation: {prompt: {text: 'go'}}\nactions: [{channels: all}]\n")
    with pytest.raises(UsageError, match=r"begins with video, state, language \(got prompt\); write state\.prompt"):
        check_policy(PolicySpec.of(address, map_file=str(file)).words, CELL)
    file.write_text("observation: {state.joints: {channels: all}}\nactions: [{channels: all}]\n")
    check_policy(PolicySpec.of(address, map_file=str(file)).words, CELL)


@pytest.mark.parametrize("power", [0.0, 50.0, 100.0])
def test_belt_carries_a_part_on_while_the_policy_thinks(power: float) -> None:
    part = Part("gear_part_1", "gear_part", Pose((1.21, 2.0, BELT_SURFACE + 0.001)))
    cell = Cell(replace(CELL, extra_parts=(part,)))
    seen: list[tuple[int, float]] = []
    acted: dict[int, float] = {}

    def place() -> float:
        return float(cell.simulation.data.body("gear_part_1").xpos[1])

    def aim(observation: Mapping[str, NDArray[np.float32]], number: int) -> list[list[float]]:
        cell.conveyors["belt"].set_power(power)
        seen.append((cell.simulation.now, place()))
        return raising(observation, number)

    def note(given: ExternalInput) -> None:
        if given.name == "/ariac/arm/command":
            acted[cell.simulation.now] = place()

    cell.bus.on_input.append(note)
    agent = PolicyAgent(spec(latency="120ms", chunk=4), lambda _setting: Scripted(aim))
    run_cell(cell, agent, options=RunOptions(until=1.5))
    observed, before = seen[4]  # the belt has its speed by now
    miss = abs(acted[observed + 150_000_000] - before)  # 120 ms, and the next control instant
    assert miss == pytest.approx(0.002 * power * 0.15, abs=5e-4)
