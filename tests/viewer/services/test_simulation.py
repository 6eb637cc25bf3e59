"""Services of `simulation_interfaces`: features, time, entities, spawning, and what a competition refuses."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright import load_trial
from cellwright.middleware.bus import PendingResponse
from cellwright.recording.replay.rebuild import Rebuilt
from cellwright.viewer.services.control import Control, Reset
from cellwright.viewer.services.entity_services import EntityServices
from cellwright.viewer.services.simulation import (
    LOADING,
    MAX_PENDING_STEPS,
    NO_WORLD,
    PAUSED,
    PLAYING,
    STOPPED,
    SimulationServices,
)
from cellwright.viewer.services.simulation_requests import (
    ALL,
    ALREADY_THERE,
    BOX,
    FAILED,
    INCORRECT_STATE,
    INCORRECT_TRANSITION,
    INVALID_POSE,
    NAME_INVALID,
    NAME_NOT_UNIQUE,
    NAMESPACE_INVALID,
    NO_RESOURCE,
    NO_WORLD_LOADED,
    NOT_FOUND,
    OK,
    PREFIX,
    SPAWN_POSE_INVALID,
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


def test_entities_are_listed_by_name_category_and_tags(shared: Services) -> None:
    names = shared("GetEntities")["entities"]
    assert {"arm", "agv1", "bin1", "conveyor_belt", GEAR} < set(names)
    assert not any(name.startswith(("clone|", "shelf", "populate")) for name in names)
    assert len(names) == len(set(names))

    def selected(**filters: Any) -> list[str]:
        found: list[str] = shared("GetEntities", filters=filters)["entities"]
        return found

    assert selected(filter="^bin8.*gear") == [name for name in names if name.startswith("bin8|gear")]
    assert selected(categories=[{"category": 1}]) == ["arm", "agv1", "agv2"]
    assert selected(tags={"tags": ["gear_part"]}) == [name for name in names if "gear_part" in name]
    assert selected(tags={"tags": ["gear_part", "bin"], "filter_mode": 1}) == []
    corners = [{"x": 0.05, "y": 0.6, "z": 2.0}, {"x": -0.65, "y": -0.1, "z": 0.5}]
    in_box = selected(bounds={"type": BOX, "points": corners})
    assert in_box
    assert {"bin7"} < {name.partition("|")[0] for name in in_box}
    assert "agv1" not in in_box


def test_categories_have_the_numbers_of_the_standard() -> None:
    services = Services()

    def of_category(number: int) -> set[str]:
        return set(services("GetEntities", filters={"categories": [{"category": number}]})["entities"])

    assert {name[-16:] for name in of_category(4)} == {"kit_tray_1::tray", "kit_tray_2::tray"}
    assert {"bin1", "conveyor_belt"} < of_category(5)
    assert not of_category(3)
    for number in (0, 1, 2, 4, 5):
        assert services.code("SetEntityInfo", entity=GEAR, info={"category": {"category": number}})[0] == OK
        assert services("GetEntityInfo", entity=GEAR)["info"]["category"] == {"category": number}
    assert services.code("SetEntityInfo", entity=GEAR, info={"category": {"category": 3}}) == (
        FAILED,
        "category must be one of 0, 1, 2, 4, 5 (got 3)",
    )


def test_state_of_moving_part_has_velocity_in_world() -> None:
    services = Services()
    turned = {**IN_BIN7, "orientation": {"x": 0.0, "y": 0.0, "z": math.sqrt(0.5), "w": math.sqrt(0.5)}}
    twist = {"linear": {"x": 0.1, "y": 0.2, "z": 0.3}, "angular": {"x": 0.0, "y": 1.0, "z": 0.0}}
    state = {"header": {"frame_id": "world"}, "pose": turned, "twist": twist}
    assert services.code("SetEntityState", entity=GEAR, state=state) == (OK, "")
    found = services("GetEntityState", entity=GEAR)["state"]
    assert found["pose"]["position"] == pytest.approx(turned["position"])
    for part in ("linear", "angular"):
        assert list(found["twist"][part].values()) == pytest.approx(list(twist[part].values()), abs=1e-12)
    for _ in range(50):
        services.cell.step()
    after = services("GetEntityState", entity=GEAR)["state"]["pose"]["position"]
    assert after["x"] - found["pose"]["position"]["x"] == pytest.approx(0.1 * 0.1, rel=0.02)


def test_state_is_set_in_named_frame() -> None:
    services = Services()
    pose = {"position": {"x": 0.0, "y": 0.0, "z": 0.2}, "orientation": {"w": 1.0}}
    state = {"header": {"frame_id": "bin7_frame"}, "pose": pose}
    assert services.code("SetEntityState", entity=GEAR, state=state)[0] == OK
    found = services("GetEntityState", entity=GEAR)["state"]["pose"]["position"]
    assert list(found.values()) == pytest.approx([-0.3, 0.23, 0.92])


@pytest.mark.parametrize(
    ("entity", "state", "code"),
    [
        ("nothing", {}, NOT_FOUND),
        ("bin1", {"pose": IN_BIN7}, FAILED),
        (GEAR, {"header": {"frame_id": "moon"}}, INVALID_POSE),
        (GEAR, {"pose": {"position": {"x": 1e9}}}, INVALID_POSE),
        (GEAR, {"pose": {"position": {"x": math.nan}}}, INVALID_POSE),
        (GEAR, {"pose": {**IN_BIN7, "orientation": {"w": 0.0}}}, INVALID_POSE),
        (GEAR, {"pose": IN_BIN7, "twist": {"linear": {"x": 1e6}}}, FAILED),
        (GEAR, {"pose": "up"}, FAILED),
    ],
)
def test_refused_state_changes_nothing(shared: Services, entity: str, state: Any, code: int) -> None:
    before = shared.cell.state_hash()
    found, reason = shared.code("SetEntityState", entity=entity, state=state)
    assert found == code
    assert reason
    assert shared.cell.state_hash() == before


def test_bounds_contain_shapes(shared: Services) -> None:
    bounds = shared("GetEntityBounds", entity="bin1")["bounds"]
    upper, lower = ([*each.values()] for each in bounds["points"])
    assert bounds["type"] == BOX
    assert np.subtract(upper, lower)[:2] == pytest.approx([0.643, 0.643], abs=0.01)  # with its posts
    assert np.add(upper, lower)[:2] / 2 == pytest.approx([-1.0, -1.33], abs=1e-3)
    assert shared.code("GetEntityBounds", entity="nothing")[0] == NOT_FOUND


def test_named_poses_are_where_parts_are_put(shared: Services) -> None:
    poses = {each["name"]: each for each in shared("GetNamedPoses")["poses"]}
    assert set(poses) == {
        *(f"bin{n}" for n in range(1, 9)),
        *("belt_start", "agv1_load_point", "agv2_load_point", "kit_tray_1", "kit_tray_2"),
    }
    assert [each["name"] for each in shared("GetNamedPoses", tags={"tags": ["tray"]})["poses"]] == [
        *("kit_tray_1", "kit_tray_2")
    ]
    for name, each in poses.items():
        upper, lower = shared("GetNamedPoseBounds", name=name)["bounds"]["points"]
        for axis, value in each["pose"]["position"].items():
            assert lower[axis] <= value <= upper[axis]
    assert shared.code("GetNamedPoseBounds", name="nowhere")[0] == NOT_FOUND


def test_part_placed_on_named_tray_stays_there() -> None:
    services = Services()
    poses = {each["name"]: each["pose"] for each in services("GetNamedPoses")["poses"]}
    pose = poses["kit_tray_1"]
    pose["position"]["z"] += 0.02
    assert services.code("SetEntityState", entity=GEAR, state={"pose": pose})[0] == OK
    for _ in range(600):
        services.cell.step()
    assert GEAR in [each.name for each in services.cell.trays[1].contents]


def test_info_lasts_until_reset() -> None:
    services = Services()
    info = {"category": {"category": 0}, "description": "mine", "tags": ["a", "b"]}
    assert services.code("SetEntityInfo", entity=GEAR, info=info)[0] == OK
    assert services("GetEntityInfo", entity=GEAR)["info"] == info
    assert services("GetEntities", filters={"tags": {"tags": ["b"]}})["entities"] == [GEAR]
    assert services.code("SetEntityInfo", entity=GEAR, info={"category": {"category": 9}})[0] == FAILED
    assert services.code("ResetSimulation")[0] == OK
    assert services("GetEntityInfo", entity=GEAR)["info"]["tags"] == ["gear_part"]


def test_deleted_part_waits_and_is_spawned_again() -> None:
    services = Services()
    piston = "bin7|piston_rod_part_3"
    assert [each["uri"] for each in services("GetSpawnables")["spawnables"]] == ["gear_part"]  # the belt's
    assert services.code("SpawnEntity", uri="piston_rod_part", initial_pose={"pose": IN_BIN7})[0] == FAILED
    assert services.code("DeleteEntity", entity=piston)[0] == OK
    assert services.code("DeleteEntity", entity=piston)[0] == NOT_FOUND
    assert services.code("DeleteEntity", entity="bin1")[0] == FAILED
    assert [each["uri"] for each in services("GetSpawnables")["spawnables"]] == ["gear_part", "piston_rod_part"]
    answer = services("SpawnEntity", uri="piston_rod_part", initial_pose={"pose": IN_BIN7})
    assert answer["entity_name"] == piston
    position = services("GetEntityState", entity=piston)["state"]["pose"]["position"]
    assert position == pytest.approx(IN_BIN7["position"])


SAMPLE = "sample"
CLONES = "populate_conveyor|piston_rod_part_clone_"


def test_spawned_clone_is_not_brought_by_belt_again() -> None:
    services = Services(trial=SAMPLE)
    waiting = {each["uri"] for each in services("GetSpawnables")["spawnables"]}
    assert waiting == set(services.entities.spawnable())
    answer = services("SpawnEntity", uri="piston_rod_part", initial_pose={"pose": IN_BIN7})
    name = answer["entity_name"]
    assert name.startswith(CLONES)
    assert name in services("GetEntities")["entities"]
    population = services.cell.population
    assert population is not None
    clones = [each for each, kind in services.cell.trial.belt_clones() if kind == "piston_rod_part"]
    assert name == f"populate_conveyor|{clones[-1]}"
    services.cell.competition.start()
    services.cell.simulation.step_until(int(1e9 * (population.entries[-1].time + 8.0)))
    assert population.brought("piston_rod_part") >= len(clones)
    position = services("GetEntityState", entity=name)["state"]["pose"]["position"]
    assert position["x"] == pytest.approx(-0.3, abs=0.1)
    assert services.code("ResetSimulation", scope=SPAWNED)[0] == OK
    assert name not in services("GetEntities")["entities"]


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ({"resource_string": "<sdf/>"}, UNSUPPORTED),
        ({"entity_resource": {"resource_string": "<sdf/>"}}, UNSUPPORTED),
        ({"uri": "piston_rod_part", "entity_namespace": "a b"}, NAMESPACE_INVALID),
        ({"uri": "piston_rod_part", "entity_namespace": "/1st"}, NAMESPACE_INVALID),
        ({}, NO_RESOURCE),
        ({"uri": "anvil"}, NOT_FOUND),
        ({"uri": "anvil", "resource_string": "<sdf/>"}, NOT_FOUND),
        ({"uri": "piston_rod_part", "name": GEAR.replace("8|gear_part", "7|piston_rod_part")}, NAME_NOT_UNIQUE),
        ({"uri": "piston_rod_part", "name": "mine"}, NAME_INVALID),
        ({"uri": "piston_rod_part", "initial_pose": {"pose": {"position": {"z": 1e9}}}}, SPAWN_POSE_INVALID),
        ({"uri": "piston_rod_part", "initial_pose": {"header": {"frame_id": "x"}}}, SPAWN_POSE_INVALID),
        ({"uri": 3}, FAILED),
    ],
)
def test_refused_spawn_changes_nothing(request_: dict[str, Any], code: int, sample: Services) -> None:
    before = sample.cell.state_hash()
    found, reason = sample.code("SpawnEntity", **request_)
    assert found == code, reason
    assert sample.cell.state_hash() == before


@pytest.fixture(scope="module")
def sample() -> Services:
    return Services(trial=SAMPLE)


def test_other_name_is_taken_if_renaming_is_allowed() -> None:
    services = Services()
    more = {"uri": "gear_part", "allow_renaming": True, "initial_pose": {"pose": IN_BIN7}}
    given = services("SpawnEntity", name="mine", **more)["entity_name"]
    assert given.startswith("populate_conveyor|gear_part_clone_")
    del more["uri"]
    resource = {"entity_resource": {"uri": "gear_part"}}  # of version 2
    assert services("SpawnEntity", name=given, **more, **resource)["entity_name"] != given


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


def test_each_service_answers_an_empty_request_with_a_code() -> None:
    services = Services(can_load=True)
    services.rate.pause()
    for name in sorted(services.handlers.keys() - {"UnloadWorld", "GetSimulatorFeatures"}):
        found = services(name)
        if isinstance(found, PendingResponse):
            services.cell.step()
            found = found.response
        assert found["result"]["result"] in {*range(5), *range(101, 110)}, name
    services.cell.step()


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


def test_worlds_are_trials(shared: Services) -> None:
    assert shared("GetCurrentWorld")["world"]["name"] == "lesson"
    worlds = shared("GetAvailableWorlds")["worlds"]
    assert {"lesson", "final01", "qual1a"} < {each["name"] for each in worlds}
    finals = shared("GetAvailableWorlds", filter={"tags": ["final, dropped part"]})["worlds"]
    assert [each["name"] for each in finals] == ["final06", "final07", "final08", "final09", "final10"]
    assert shared.code("GetAvailableWorlds", additional_sources=["x"])[0] == UNSUPPORTED


def test_world_is_loaded_by_name_or_text() -> None:
    for request, name in (
        ({"uri": "final01"}, "final01"),
        ({"world_resource": {"uri": "final01"}}, "final01"),  # of version 2
        ({"uri": "final01", "resource_string": "time_limit: soon"}, "final01"),
        ({"resource_string": "time_limit: 60"}, load_trial(text="time_limit: 60").name),
    ):
        services = Services(can_load=True)
        assert {40, 41, 43} < services.features
        assert services("LoadWorld", **request)["world"]["name"] == name
        assert [trial.name for trial in services.loaded] == [name]
        assert services("GetSimulationState")["state"]["state"] == 5
        assert services.code("LoadWorld", uri="lesson")[0] == INCORRECT_STATE
        assert services.code("SetSimulationState", state={"state": 2})[0] == INCORRECT_TRANSITION


@pytest.mark.parametrize(
    ("request_", "code", "reason"),
    [
        ({}, 102, "either uri"),
        ({"uri": "lessen"}, NOT_FOUND, "did you mean lesson"),
        ({"uri": "lessen", "resource_string": "time_limit: 60"}, NOT_FOUND, "did you mean lesson"),
        ({"uri": "/etc/hostname"}, NOT_FOUND, "unknown trial"),
        ({"resource_string": "time_limit: soon"}, 103, "time_limit"),
        ({"resource_string": "{"}, 103, "1:"),
        ({"resource_string": "a: 1\n" * 560_000}, 103, "more than 512 KiB of text"),
        ({"world_resource": {"resource_string": "a: 1\n" * 560_000}}, 103, "more than 512 KiB of text"),
    ],
)
def test_wrong_world_is_refused(request_: dict[str, str], code: int, reason: str) -> None:
    services = Services(can_load=True)
    found, message = services.code("LoadWorld", **request_)
    assert (found, services.loaded) == (code, [])
    assert reason in message


def test_session_that_cannot_load_says_so(shared: Services) -> None:
    for name in ("LoadWorld", "UnloadWorld"):
        found, message = shared.code(name, uri="final01")
        assert found == UNSUPPORTED
        assert "serve -d" in message


def test_unloaded_world_stands_and_offers_nothing_until_another_is_loaded() -> None:
    services = Services(can_load=True)
    services.cell.step()
    assert services.code("UnloadWorld")[0] == OK
    assert (services.state, services.cell.simulation.now) == (NO_WORLD, 0)
    assert not services.rate.take()
    assert services.code("UnloadWorld")[0] == NO_WORLD_LOADED
    assert services.code("GetCurrentWorld")[0] == NO_WORLD_LOADED
    for name in ("GetEntities", "GetNamedPoses", "ResetSimulation", "StepSimulation"):
        assert services.code(name)[0] == INCORRECT_STATE, name
    assert services.code("SetSimulationState", state={"state": PLAYING})[0] == INCORRECT_TRANSITION
    assert not services.rate.take()
    assert not services.features & {25, 26, 31, 32, 33}
    assert services("LoadWorld", uri="final01")["world"]["name"] == "final01"
    assert services.state == LOADING


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


def test_worlds_name_no_path_of_this_machine(shared: Services) -> None:
    assert str(Path.cwd()) not in str(shared("GetCurrentWorld")) + str(shared("GetAvailableWorlds"))
