"""Services of entities in `simulation_interfaces`: frames, bounds, accelerations, and several parts at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from cellwright.util.pose import Pose
from cellwright.viewer.services.simulation_requests import (
    BOX,
    FAILED,
    INVALID_POSE,
    NAME_INVALID,
    NAME_NOT_UNIQUE,
    NOT_FOUND,
    OK,
    SPAWN_FAILED,
    SPAWN_POSE_INVALID,
    SPHERE,
)
from tests.viewer.services.simulated import GEAR, IN_BIN7, Services

SAMPLE, PISTON = "sample", "piston_rod_part"


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
