"""Services of `simulation_interfaces`: features, time, entities, spawning, and what a competition refuses."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from cellwright.middleware.bus import PendingResponse
from cellwright.recording.replay.rebuild import Rebuilt
from cellwright.viewer.services.control import Control, Reset
from cellwright.viewer.services.entity_services import EntityServices
from cellwright.viewer.services.simulation import MAX_PENDING_STEPS, PAUSED, PLAYING, STOPPED, SimulationServices
from cellwright.viewer.services.simulation_requests import (
    ALL,
    ALREADY_THERE,
    FAILED,
    INCORRECT_STATE,
    INCORRECT_TRANSITION,
    OK,
    PREFIX,
    SPAWNED,
    STATE,
    TIME,
    UNSUPPORTED,
)
from tests.viewer.services.simulated import GEAR, IN_BIN7, STEP, Services


@pytest.fixture(scope="module")
def shared() -> Services:
    """Services for tests that change nothing."""
    return Services()


def test_each_feature_of_development_cell_is_listed(shared: Services) -> None:
    features = shared("GetSimulatorFeatures")["features"]["features"]
    assert features == [*range(9), *range(10, 15), *range(20, 27), 31, 32, 33, 42, 44, 45, 50]


def test_competition_lists_what_it_answers_only() -> None:
    services = Services(competition=True)
    assert services("GetSimulatorFeatures")["features"]["features"] == [2, 3, 24, 42, 44, 45]
    public = {"GetSimulatorFeatures", "GetSimulationState", "GetCurrentWorld", "GetAvailableWorlds"}
    public |= {"GetNamedPoses", "GetNamedPoseBounds"}
    for name in services.handlers.keys() - public:
        assert services.code(name, entity=GEAR) == (UNSUPPORTED, "not allowed in a competition")
    for name in public - {"GetSimulatorFeatures"}:
        assert services.code(name, name="bin1")[0] == OK
    assert not services.acting


SAMPLE = "sample"


def test_state_is_stopped_playing_or_paused() -> None:
    services = Services()

    def state() -> int:
        found: int = services("GetSimulationState")["state"]["state"]
        return found

    assert state() == 1
    assert services.code("SetSimulationState", state={"state": 1})[0] == 101
    assert services.code("SetSimulationState", state={"state": 7})[0] == UNSUPPORTED
    assert services.code("SetSimulationState", state={"state": 5})[0] == INCORRECT_TRANSITION
    assert services.code("SetSimulationState", state={})[0] == FAILED
    services.cell.step()
    assert services.code("SetSimulationState", state={"state": 2})[0] == OK
    assert (state(), services.rate.is_paused) == (2, True)
    assert services.code("SetSimulationState", state={"state": 0})[0] == OK
    assert (state(), services.cell.simulation.now) == (0, 0)
    assert services.code("SetSimulationState", state={"state": 1})[0] == OK
    assert state() == 1
    assert services.code("SetSimulationState", state={"state": 3})[0] == OK
    assert services.stop.reason


def test_stopped_simulation_can_be_paused_and_stopped_again() -> None:
    services = Services()
    assert services.code("SetSimulationState", state={"state": STOPPED})[0] == OK
    assert services.state == STOPPED
    assert services.code("SetSimulationState", state={"state": PAUSED})[0] == OK
    assert services.state == PAUSED
    assert services.code("SetSimulationState", state={"state": PAUSED})[0] == ALREADY_THERE
    assert services.code("SetSimulationState", state={"state": STOPPED})[0] == OK
    assert services.state == STOPPED
    services.step(1)
    assert services.code("ResetSimulation", scope=STATE)[0] == OK
    assert services.state == PAUSED  # message time is not at its begin
    assert services.code("ResetSimulation")[0] == OK
    assert services.state == STOPPED


def test_stop_whose_reset_is_refused_lets_time_pass() -> None:
    services = Services()
    refused = Control(services.rate, reset=Reset(services.cell.reset, lambda: "emergency stop"))
    SimulationServices(services.cell, refused, stop=services.stop).offer(services)
    services.cell.step()
    assert services.code("SetSimulationState", state={"state": STOPPED}) == (UNSUPPORTED, "emergency stop")
    assert not services.rate.is_paused
    assert services.cell.simulation.clock.tick == 1


def test_steps_are_answered_when_they_have_passed() -> None:
    services = Services()
    assert services.code("StepSimulation", steps=3)[0] == FAILED
    assert services.cell.simulation.clock.tick == 0
    services.rate.pause()
    assert services.code("StepSimulation", steps=0)[0] == FAILED
    assert services.code("StepSimulation", steps=2**32)[0] == FAILED
    pending = services("StepSimulation", steps=3)
    assert isinstance(pending, PendingResponse)
    passed = []
    while services.rate.take():
        passed.append(pending.response)
        services.cell.step()
    assert passed == [None] * 3
    assert pending.response["result"]["result"] == OK
    assert services.cell.simulation.clock.tick == 3
    assert not services.rate.take()


def test_calls_that_wait_for_steps_are_limited() -> None:
    services = Services()
    services.rate.pause()
    waiting = [services("StepSimulation", steps=1) for _ in range(MAX_PENDING_STEPS)]
    assert services.code("StepSimulation", steps=1)[0] == INCORRECT_STATE
    for answered in range(MAX_PENDING_STEPS):
        assert [each.response is not None for each in waiting].count(True) == answered
        services.cell.step()
    assert all(each.response["result"]["result"] == OK for each in waiting)
    assert isinstance(services("StepSimulation", steps=1), PendingResponse)


def test_running_steps_can_be_resumed_for_good() -> None:
    services = Services()
    services.rate.pause()
    pending = services("StepSimulation", steps=2)
    assert services("GetSimulationState")["state"]["state"] == PLAYING
    assert services.code("SetSimulationState", state={"state": PLAYING})[0] == OK
    assert not services.rate.is_paused
    assert services.code("SetSimulationState", state={"state": PLAYING})[0] == ALREADY_THERE
    for _ in range(2):
        services.cell.step()
    assert pending.response["result"]["result"] == OK


def test_pause_interrupts_steps() -> None:
    services = Services()
    services.rate.pause()
    pending = services("StepSimulation", steps=100)
    services.cell.step()
    assert services.code("SetSimulationState", state={"state": PAUSED})[0] == OK
    assert pending.response["result"] == {"result": FAILED, "error_message": "the simulation was paused meanwhile"}


def test_reset_interrupts_steps() -> None:
    services = Services()
    services.rate.pause()
    pending = services("StepSimulation", steps=100)
    services.cell.step()
    services.cell.reset()
    assert pending.response["result"] == {"result": FAILED, "error_message": "the simulation was reset meanwhile"}
    services.cell.step()


def test_lockstep_has_its_own_steps() -> None:
    services = Services(lockstep=True)
    services.rate.pause()
    assert services.code("StepSimulation", steps=1)[0] == UNSUPPORTED
    assert not services.features & {31, 32, 33}


@pytest.mark.parametrize(
    ("scope", "tick", "time"),
    [(0, 0, 0), (255, 0, 0), (7, 0, 0), (3, 0, 0), (2, 0, STEP), (6, 0, STEP), (1, 1, 0), (5, 1, 0), (4, 1, STEP)],
)
def test_reset_has_time_and_state_of_its_own(scope: int, tick: int, time: int) -> None:
    services = Services()
    services.cell.step()
    assert services.code("ResetSimulation", scope=scope)[0] == OK
    clock = services.cell.simulation.clock
    assert (clock.tick, clock.message_time()) == (tick, time)
    services.cell.step()
    assert clock.message_time() == time + STEP


def test_unknown_scope_is_unsupported_and_changes_nothing() -> None:
    services = Services()
    services.cell.step()
    assert services.code("ResetSimulation", scope=8)[0] == UNSUPPORTED
    assert services.cell.simulation.clock.tick == 1


def test_state_of_entity_is_stamped_with_time_that_goes_on() -> None:
    services = Services()
    services.cell.step()
    assert services.code("ResetSimulation", scope=STATE)[0] == OK
    services.cell.step()
    stamp = services("GetEntityState", entity=GEAR)["state"]["header"]["stamp"]
    assert stamp == {"sec": 0, "nanosec": 2 * STEP}


@pytest.mark.parametrize("scope", [STATE, STATE | TIME])
def test_reset_of_state_keeps_what_was_spawned(scope: int) -> None:
    services = Services(trial=SAMPLE)
    name = services("SpawnEntity", uri="piston_rod_part", initial_pose={"pose": IN_BIN7})["entity_name"]
    for _ in range(20):
        services.cell.step()
    services("SetEntityState", entity=name, state={"pose": {**IN_BIN7, "position": {"z": 1.5}}})
    assert services.code("ResetSimulation", scope=scope)[0] == OK
    assert services.position(name) == pytest.approx(list(IN_BIN7["position"].values()))
    assert services.cell.simulation.clock.message_time() == (0 if scope & TIME else 20 * STEP)
    assert services.code("SetEntityState", entity=name, state={"pose": IN_BIN7})[0] == OK
    assert services.code("ResetSimulation", scope=SPAWNED)[0] == OK
    assert name not in services("GetEntities")["entities"]


def test_deleted_part_of_trial_is_back_after_reset_of_state() -> None:
    services = Services()
    before = services.position(GEAR)
    services("DeleteEntity", entity=GEAR)
    assert services("SpawnEntity", name=GEAR, uri="gear_part", initial_pose={"pose": IN_BIN7})["entity_name"] == GEAR
    assert services.code("ResetSimulation", scope=STATE)[0] == OK
    assert services.position(GEAR) == before


def test_whole_reset_deletes_what_was_spawned() -> None:
    services = Services(trial=SAMPLE)
    before = services.cell.state_hash()
    request = {"uri": "piston_rod_part", "initial_pose": {"pose": IN_BIN7}}
    name = services("SpawnEntity", **request)["entity_name"]
    for scope in (0, STATE | SPAWNED):
        services.cell.step()
        assert services.code("ResetSimulation", scope=scope)[0] == OK
        assert name not in services("GetEntities")["entities"]
        assert services.cell.state_hash() == before
        assert services("SpawnEntity", name=name, **request)["entity_name"] == name


def test_features_lack_resets_that_are_refused() -> None:
    services = Services()
    reset = Reset(services.cell.reset)

    def features(control: Control, *, has_clock: bool = True) -> set[int]:
        SimulationServices(services.cell, control, stop=services.stop, has_clock=has_clock).offer(services)
        return set(services("GetSimulatorFeatures")["features"]["features"])

    assert features(Control(services.rate, reset=reset)) & {20, 21, 22} == {20, 21}
    assert services.code("ResetSimulation", scope=STATE)[0] == UNSUPPORTED
    both = replace(reset, act_on_state=partial(services.cell.reset, keeps_clock=True))
    assert features(Control(services.rate, reset=both), has_clock=False) & {20, 21, 22} == {20, 22}
    assert services.code("ResetSimulation", scope=TIME | STATE)[0] == UNSUPPORTED
    assert services.code("ResetSimulation", scope=ALL)[0] == OK


def test_robot_without_entities_has_services_of_time() -> None:
    services = Services()
    control = Control(services.rate, refused={"pause": "a real robot runs in real time"})
    services.handlers.clear()
    SimulationServices(services.cell, control, stop=services.stop).offer(services)
    assert set(services.handlers) == {
        *("GetSimulatorFeatures", "GetSimulationState", "SetSimulationState", "ResetSimulation", "StepSimulation")
    }
    assert services("GetSimulatorFeatures")["features"]["features"] == [21, 24]
    reason = "a real robot runs in real time"
    assert services.code("SetSimulationState", state={"state": 2}) == (UNSUPPORTED, reason)
    assert services.code("StepSimulation", steps=1) == (UNSUPPORTED, reason)
    for scope in (0, STATE, SPAWNED):
        assert services.code("ResetSimulation", scope=scope)[0] == UNSUPPORTED


def test_recorded_requests_act_again() -> None:
    first, again = Services(trial=SAMPLE), Services(trial=SAMPLE)
    replayed = EntityServices(again.cell).replayed()
    assert {name.removeprefix(PREFIX) for name in replayed} == first.acting
    spawned = first("SpawnEntity", uri="piston_rod_part", initial_pose={"pose": IN_BIN7})["entity_name"]
    extras = Rebuilt(again.cell, extras=replayed).extras
    extras[f"{PREFIX}SpawnEntity"]({"uri": "piston_rod_part", "initial_pose": {"pose": IN_BIN7}})
    first.cell.step()
    again.cell.step()
    assert spawned in again.cell.parts.in_play
    assert first.cell.state_hash() == again.cell.state_hash()
    first("ResetSimulation", scope=SPAWNED)
    extras[f"{PREFIX}ResetSimulation"]({"scope": SPAWNED})
    assert first.cell.state_hash() == again.cell.state_hash()


def test_joint_states_are_of_the_time_of_the_clock_and_equally_long() -> None:
    services = Services()
    times: list[int] = []
    found: list[tuple[int, set[int]]] = []
    bus = services.cell.bus

    def nanoseconds(stamp: Any) -> int:
        return int(stamp.sec * 10**9 + stamp.nanosec)

    def take(message: Any) -> None:
        lengths = {len(each) for each in (message.name, message.position, message.velocity, message.effort)}
        found.append((times[-1] - nanoseconds(message.header.stamp), lengths))

    bus.subscribe("/clock", lambda message: times.append(nanoseconds(message.clock)))
    bus.subscribe("/ariac/joint_states", take)
    for scope in (None, STATE, TIME):
        if scope is not None:
            assert services.code("ResetSimulation", scope=scope)[0] == OK
        for _ in range(50):
            services.cell.step()
    assert len(found) >= 12
    assert all(0 <= age <= 100_000_000 and len(lengths) == 1 for age, lengths in found)
