"""Services of entities in `simulation_interfaces`: frames, bounds, accelerations, and several parts at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from cellwright.util.pose import Pose
from cellwright.viewer.services.entity_services import EntityServices
from cellwright.viewer.services.simulation_requests import (
    BOX,
    FAILED,
    INVALID_POSE,
    NAME_INVALID,
    NAME_NOT_UNIQUE,
    NAMESPACE_INVALID,
    NO_RESOURCE,
    NOT_FOUND,
    OK,
    PREFIX,
    SPAWN_FAILED,
    SPAWN_POSE_INVALID,
    SPAWNED,
    SPHERE,
    UNSUPPORTED,
)
from tests.viewer.services.simulated import GEAR, IN_BIN7, Services

SAMPLE, PISTON = "sample", "piston_rod_part"
CLONES = "populate_conveyor|piston_rod_part_clone_"


@pytest.fixture(scope="module")
def shared() -> Services:
    """Services for tests that change nothing, or place the gear alone."""
    return Services()


@pytest.mark.parametrize("frame", ["agv1", "bin1", "agv1_load_point_frame", "wrist_3_link", "tool0"])
def test_pose_is_set_in_any_frame_of_the_cell(shared: Services, frame: str) -> None:
    away = {"position": {"x": 0.1, "y": 0.2, "z": 1.0}, "orientation": {"w": 1.0}}
    state = {"header": {"frame_id": frame}, "pose": away, "twist": {"linear": {"x": 1.0}}}
    assert shared.code("SetEntityState", entity=GEAR, state=state) == (OK, "")
    world_T_frame = shared.entities.frame(frame)
    assert shared.position(GEAR) == pytest.approx((world_T_frame @ Pose((0.1, 0.2, 1.0))).position)
    linear = shared("GetEntityState", entity=GEAR)["state"]["twist"]["linear"]
    assert list(linear.values()) == pytest.approx(world_T_frame.rotate((1.0, 0.0, 0.0)), abs=1e-9)


def test_frames_of_entities_and_links_are_where_they_are(shared: Services) -> None:
    assert list(shared.entities.frame("agv1").position) == shared.position("agv1")
    assert shared.entities.frame("base").position == shared.entities.frame("base_link").position
    assert shared.entities.frame("world") == Pose((0.0, 0.0, 0.0))


def test_pose_in_frame_of_part_follows_it() -> None:
    services = Services()
    turned = {**IN_BIN7, "orientation": {"z": math.sqrt(0.5), "w": math.sqrt(0.5)}}
    services("SetEntityState", entity=GEAR, state={"pose": turned})
    request = {"header": {"frame_id": GEAR}, "pose": {"position": {"x": 0.2}}}
    name = services("SpawnEntity", uri="gear_part", initial_pose=request)["entity_name"]
    assert services.position(name) == pytest.approx([-0.3, 0.43, 0.9])


def test_unknown_frame_is_refused_and_moves_nothing(shared: Services) -> None:
    before = shared.cell.state_hash()
    pose = {"header": {"frame_id": "nowhere"}, "pose": IN_BIN7}
    code, reason = shared.code("SetEntityState", entity=GEAR, state=pose)
    assert (code, "unknown frame 'nowhere'" in reason) == (INVALID_POSE, True), reason
    assert shared.code("SpawnEntity", uri="gear_part", initial_pose=pose)[0] == SPAWN_POSE_INVALID
    assert shared.cell.state_hash() == before


@pytest.mark.parametrize("name", ["bin1", "agv1", "arm", "agv1::kit_tray_1::kit_tray_1::tray"])
def test_what_is_no_part_stays_and_takes_no_twist(shared: Services, name: str) -> None:
    before = shared.cell.state_hash()
    for state in ({"twist": {"linear": {"x": 1.0}}}, {"pose": IN_BIN7}):
        code, reason = shared.code("SetEntityState", entity=name, state=state)
        assert code == FAILED
        assert "only parts can be placed" in reason
    assert shared.cell.state_hash() == before


def test_only_what_is_set_changes() -> None:
    services = Services()
    moving = {"pose": IN_BIN7, "twist": {"linear": {"z": 0.5}}}
    more = {"entity": GEAR, "set_acceleration": False}  # flags of version 2.1

    def now() -> tuple[list[float], list[float]]:
        state = services("GetEntityState", entity=GEAR)["state"]
        return list(state["pose"]["position"].values()), list(state["twist"]["linear"].values())

    before = now()
    assert services.code("SetEntityState", state=moving, set_pose=False, set_twist=False, **more)[0] == OK
    assert now() == before
    assert services.code("SetEntityState", state=moving, set_pose=False, set_twist=True, **more)[0] == OK
    assert now() == (before[0], [0.0, 0.0, 0.5])
    assert services.code("SetEntityState", state=moving, set_pose=True, set_twist=False, **more)[0] == OK
    assert now() == ([-0.3, 0.23, 0.9], [0.0, 0.0, 0.0])


def test_acceleration_of_part_is_that_of_its_motion() -> None:
    services = Services()
    services.rate.pause()

    def acceleration(kind: str = "linear") -> list[float]:
        return list(services("GetEntityState", entity=GEAR)["state"]["acceleration"][kind].values())

    assert services.code("SetEntityState", entity=GEAR, state={"pose": {**IN_BIN7, "position": {"z": 2.0}}})[0] == OK
    assert acceleration() == [0.0, 0.0, 0.0]
    services.step(3)
    assert acceleration() == pytest.approx(services.cell.simulation.model.opt.gravity, abs=0.01)
    assert acceleration("angular") == pytest.approx([0.0, 0.0, 0.0], abs=0.01)
    services("SetEntityState", entity=GEAR, state={"pose": IN_BIN7})
    for _ in range(1500):
        services.cell.step()
    assert acceleration() == pytest.approx([0.0, 0.0, 0.0], abs=0.05)
    assert services("GetEntityState", entity="bin1")["state"]["acceleration"]["linear"] == {"x": 0, "y": 0, "z": 0}


def test_acceleration_of_carried_entity_has_no_gravity(shared: Services) -> None:
    found = shared("GetEntityState", entity="agv1")["state"]["acceleration"]["linear"]
    assert list(found.values()) == pytest.approx([0.0, 0.0, 0.0], abs=0.05)


def test_bounds_along_axes_of_world_grow_with_a_turn(shared: Services) -> None:
    def size(angle: float) -> Any:
        turn = {"z": math.sin(angle / 2), "w": math.cos(angle / 2)}
        shared("SetEntityState", entity=GEAR, state={"pose": {**IN_BIN7, "orientation": turn}})
        upper, lower = ([*each.values()] for each in shared("GetEntityBounds", entity=GEAR)["bounds"]["points"])
        assert (np.add(upper, lower) / 2)[:2] == pytest.approx([-0.3, 0.23], abs=0.02)
        return np.subtract(upper, lower)

    straight, turned = size(0.0), size(math.pi / 4)
    assert (turned[:2] > straight[:2] * 1.05).all()
    assert turned[2] == pytest.approx(straight[2])


def test_bounds_select_what_overlaps_them_and_not_only_origins(shared: Services) -> None:
    def selected(kind: int, *points: tuple[float, float, float]) -> list[str]:
        bounds = {"type": kind, "points": [dict(zip("xyz", each, strict=True)) for each in points]}
        found: list[str] = shared("GetEntities", filters={"bounds": bounds})["entities"]
        states = shared("GetEntitiesStates", filters={"bounds": bounds})
        assert states["entities"] == found
        return found

    upper, lower = ([*each.values()] for each in shared("GetEntityBounds", entity="conveyor_belt")["bounds"]["points"])
    end = (upper[0] - 0.01, upper[1] - 0.01, upper[2] - 0.01)
    assert "conveyor_belt" in selected(SPHERE, end, (0.005, 0.0, 0.0))
    assert math.dist(end, shared.position("conveyor_belt")) > 0.3
    assert selected(BOX, (upper[0], upper[1], 9.0), (lower[0], lower[1], 8.0)) == []
    assert len(selected(BOX, (50.0, 50.0, 50.0), (-50.0, -50.0, -50.0))) == len(shared("GetEntities")["entities"])


def test_several_parts_are_spawned_each_with_its_result() -> None:
    services = Services(trial=SAMPLE)
    resource = {"uri": PISTON, "resource_string": ""}
    there = {"entity_resource": resource, "initial_pose": {"pose": IN_BIN7}}
    other = {**there, "entity_resource": {"uri": "part4"}, "entity_namespace": "/cell_1/part"}
    assert services("SpawnEntities", spawn_requests=[])["result"]["result"] == OK
    answer = services("SpawnEntities", spawn_requests=[there, other])
    assert answer["result"] == {"result": OK, "error_message": ""}
    names = [each["entity_name"] for each in answer["results"]]
    assert len(set(names)) == 2
    assert set(names) < set(services("GetEntities")["entities"])
    services("DeleteEntity", entity=names[0])
    bad = {**there, "entity_resource": {"uri": "anvil"}}
    answer = services("SpawnEntities", spawn_requests=[{**there, "name": names[1]}, bad, there])
    assert answer["result"]["result"] == SPAWN_FAILED
    assert [each["result"]["result"] for each in answer["results"]] == [NAME_NOT_UNIQUE, NOT_FOUND, OK]
    assert [bool(each["entity_name"]) for each in answer["results"]] == [False, False, True]


def test_empty_name_takes_that_of_the_waiting_part_and_an_own_one_needs_renaming() -> None:
    services = Services()
    request = {"uri": "gear_part", "initial_pose": {"pose": IN_BIN7}}
    assert services.code("SpawnEntity", name="mine", **request)[0] == NAME_INVALID
    first = services("SpawnEntity", **request)["entity_name"]
    second = services("SpawnEntity", name="mine", allow_renaming=True, **request)["entity_name"]
    for name in (first, second):
        assert name in services("GetEntities")["entities"]
        assert services.code("DeleteEntity", entity=name)[0] == OK


def test_type_of_which_no_part_waits_fails_and_is_known() -> None:
    services = Services()
    code, reason = services.code("SpawnEntity", uri=PISTON, initial_pose={"pose": IN_BIN7})
    assert (code, reason) == (FAILED, f"uri: no part of type {PISTON} waits; delete one, or spawn another type")


def test_unknown_sources_of_spawnables_are_named(shared: Services) -> None:
    found = shared("GetSpawnables", sources=["/models", "fuel"])
    assert found["result"] == {"result": OK, "error_message": "unknown sources: /models, fuel"}
    assert found["spawnables"] == shared("GetSpawnables")["spawnables"]


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


def test_spawned_clone_is_not_brought_by_belt_again() -> None:
    services = Services(trial=SAMPLE)
    waiting = {each["uri"] for each in services("GetSpawnables")["spawnables"]}
    assert waiting == set(services.entities.spawnable())
    answer = services("SpawnEntity", uri="piston_rod_part", initial_pose={"pose": IN_BIN7})
    name = answer["entity_name"]
    assert name.startswith(CLONES)
    assert name in services("GetEntities")["entities"]
    population = services.cell.populations["belt"]
    clones = [each for each, kind in services.cell.trial.belt_clones() if kind == "piston_rod_part"]
    assert name == f"populate_conveyor|{clones[-1]}"
    services.cell.competition.start()
    services.cell.simulation.step_until(int(1e9 * (population.entries[-1].time + 8.0)))
    assert not population.is_ahead("piston_rod_part", len(clones) - 1)
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


def test_services_that_act_on_entities_are_recorded_as_acting(shared: Services) -> None:
    assert {name.removeprefix(PREFIX) for name in shared.acting} >= EntityServices.ACTING
