"""AGV and its kit on the way, in the running cell."""

import math
from fractions import Fraction

import pytest

from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.util.errors import CellwrightError
from tests.cell.devices.floor import MM, Floor, down, named
from tests.support.places import AGVS, TRAY_SURFACE

KIT = {
    "gear_part": (-0.17, 0.25),
    "disk_part": (0.15, 0.25),
    "gasket_part": (-0.1, 0.1),
    "piston_rod_part": (0.15, 0.0),
    "pulley_part": (-0.1, -0.2),
    "part2": (0.12, -0.2),
}
"""Positions of a kit's parts around the middle of a tray [m]."""


def lay_kit(floor: Floor, agv: int = 1) -> None:
    for kind, (dx, dy) in KIT.items():
        floor.lay(named(kind), 0.3 + dx, (3.15 if agv == 1 else -3.15) + dy, TRAY_SURFACE)


def in_tray(floor: Floor, tray: KitTray) -> dict[str, tuple[float, float, float]]:
    tray_T_world = tray.world_T_tray.inverse()
    return {kind: tray_T_world.transform(floor.pose(named(kind)).position) for kind in KIT}


def slip_on_the_way(floor: Floor, agv: Agv) -> float:
    """Return the maximum movement of any part of the kit against the tray from departure to arrival [m]."""
    floor.run_until(lambda: agv.state == "delivering", 1.0)
    before = in_tray(floor, agv.tray)
    worst = 0.0
    while agv.state == "delivering":
        now = in_tray(floor, agv.tray)
        worst = max(worst, *(math.dist(now[kind], before[kind]) for kind in KIT))
        floor.cell.step()
    return worst


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_agv_states_change_on_time(floor: Floor, number: int) -> None:
    agv = floor.cell.agvs[number]
    floor.run(0.5)
    start = floor.simulation.now
    assert agv.send("order_0_kit_0")
    changes = [("preparing_to_deliver", 0)]
    while agv.state != "ready_to_deliver":
        floor.cell.step()
        if agv.state != changes[-1][0]:
            changes.append((agv.state, floor.simulation.now - start))
    ticks = [(state, round(time / 2e6)) for state, time in changes]
    assert ticks == [
        ("preparing_to_deliver", 0),
        ("delivering", 375),
        ("delivered", 375 + 4167),  # 8.333 s
        ("returning", 375 + 4167 + 1),
        ("ready_to_deliver", 375 + 4167 + 1 + 5000),
    ]
    assert changes[-1][1] == pytest.approx(19.1e9, abs=0.02e9)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_agv_reaches_key_frames_on_time(floor: Floor, number: int) -> None:
    agv = floor.cell.agvs[number]
    side = 1.0 if number == 1 else -1.0
    agv.send("kit")
    for state, frames in (("delivering", AGVS[1].out), ("returning", AGVS[1].back)):
        floor.run_until(lambda state=state: agv.state == state, 10.0)  # type: ignore[misc]
        start = floor.simulation.now
        for time, x, y in frames:
            floor.simulation.step_until(start + round(Fraction(time) / Fraction(6, 5) * 1_000_000_000))
            there = floor.body_pose(agv.name).position
            assert math.dist(there[:2], (x, side * y)) < 5 * MM
    floor.run(0.5)
    assert math.dist(floor.body_pose(agv.name).position, (0.3, side * 3.3, 0.0)) < 0.1 * MM


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_locked_kit_does_not_slide_on_moving_agv(floor: Floor, number: int) -> None:
    agv = floor.cell.agvs[number]
    lay_kit(floor, number)
    floor.run(1.5)
    agv.send("kit")
    assert slip_on_the_way(floor, agv) < 0.1 * MM


@pytest.mark.slow
def test_unlocked_kit_is_carried_by_friction(floor: Floor, monkeypatch: pytest.MonkeyPatch) -> None:
    agv = floor.cell.agvs[1]
    monkeypatch.setattr(agv.tray, "lock", lambda: None)
    lay_kit(floor)
    floor.run(1.5)
    agv.send("kit")
    slip = slip_on_the_way(floor, agv)
    assert 0.05 * MM < slip < 0.5 * MM  # 0.2: the engine's friction yields a little, without release


@pytest.mark.slow
def test_kit_is_submitted_at_departure_and_removed_on_delivery(floor: Floor) -> None:
    agv = floor.cell.agvs[1]
    lay_kit(floor)
    floor.run(1.5)
    submitted: list[tuple[int, str, int]] = []
    agv.on_submit.append(lambda each, kit: submitted.append((floor.simulation.now, kit, len(each.tray.contents))))
    start = floor.simulation.now
    try:
        agv.send("some kit")
        floor.run_until(lambda: agv.state == "delivered", 10.0)
    finally:
        agv.on_submit.pop()
    assert submitted == [(start + 750_000_000, "some kit", len(KIT))]
    assert agv.tray.contents == ()
    assert floor.cell.parts.in_play.isdisjoint(named(kind) for kind in KIT)
    floor.run_until(lambda: agv.state == "ready_to_deliver", 11.0)
    floor.run(1.0)
    assert agv.tray.contents == ()
    assert all(floor.pose(named(kind)).position[1] < -30.0 for kind in KIT)


@pytest.mark.slow
def test_unreported_part_returns_with_agv(floor: Floor) -> None:
    agv = floor.cell.agvs[1]
    agv.send("kit")
    floor.run(0.745)
    floor.lay(named("part2"), 0.3, 3.15, TRAY_SURFACE)
    floor.run_until(lambda: agv.state == "ready_to_deliver", 20.0)
    floor.run(1.0)
    assert [each.name for each in agv.tray.contents] == [named("part2")]


def test_call_to_moving_agv_is_refused_without_effect(floor: Floor) -> None:
    agv = floor.cell.agvs[1]
    assert agv.send("first")
    while True:
        assert not agv.send("second")
        assert agv.kit_type == "first"
        floor.run(0.5)
        if floor.now > 18.9:
            break
    floor.run_until(lambda: agv.state == "ready_to_deliver", 1.0)
    assert agv.send("second")
    assert agv.kit_type == "second"


def test_both_agvs_drive_at_same_time(floor: Floor) -> None:
    for number in (1, 2):
        floor.cell.agvs[number].send("kit")
    floor.run(6.0)
    first, second = (floor.body_pose(f"agv{number}").position for number in (1, 2))
    assert second == pytest.approx((first[0], -first[1], first[2]), abs=0.1 * MM)
    assert first[1] > 5.0


@pytest.mark.slow
def test_agv_and_kit_at_rest_sleep(floor: Floor) -> None:
    lay_kit(floor)
    floor.run(1.0)
    agv = floor.model.body("agv1").id
    assert floor.asleep(agv)
    assert all(floor.asleep(floor.part(named(kind)).body) for kind in KIT)
    floor.cell.agvs[1].send("kit")
    floor.run(2.0)
    assert not floor.asleep(agv)
    floor.run_until(lambda: floor.cell.agvs[1].state == "ready_to_deliver", 20.0)
    floor.run(1.0)
    assert floor.asleep(agv)


def test_departing_agv_takes_part_from_enabled_gripper(floor: Floor) -> None:
    name = named("part2")
    floor.put_arm((2.0, 1.5, -0.27, 1.02, 4.0, -1.51, 0.0))
    floor.lay(name, 0.25, 3.1, TRAY_SURFACE)
    floor.put_arm(floor.reach(down(0.25, 3.1, TRAY_SURFACE + 0.0095)))
    floor.gripper.set_enabled(True)
    floor.run_until(lambda: floor.gripper.attached, 0.5)
    agv = floor.cell.agvs[1]
    floor.run(1.0)
    agv.send("kit")
    floor.run(0.75)
    assert (floor.gripper.attached, floor.gripper.lost_reason) == (False, "taken away")
    floor.run(0.1)
    assert floor.gripper.reason == f"contact with something fixed: {name}"
    floor.run_until(lambda: agv.state == "delivered", 10.0)
    assert name not in floor.cell.parts.in_play
    assert not floor.gripper.attached
    assert not any(floor.simulation.data.warning.number)


def test_agv_departs_while_cup_presses_part_into_tray(floor: Floor) -> None:
    floor.put_arm((2.0, 1.5, -0.27, 1.02, 4.0, -1.51, 0.0))
    floor.lay(named("part2"), 0.25, 3.1, TRAY_SURFACE)
    floor.put_arm(floor.reach(down(0.25, 3.1, TRAY_SURFACE + 0.0095)))
    floor.gripper.set_enabled(True)
    floor.run_until(lambda: floor.gripper.attached, 0.5)
    floor.run(0.1)
    agv = floor.cell.agvs[1]
    floor.send(floor.reach(down(0.25, 3.1, TRAY_SURFACE - 0.02)), seconds=0.1)
    agv.send("kit")
    agv.tray.contents = ()
    floor.run_until(lambda: agv.state == "delivered", 10.0)
    assert not any(floor.simulation.data.warning.number)  # an engine that diverges reports it here, and resets itself
    assert math.dist(floor.body_pose("agv1").position[:2], AGVS[1].out[-1][1:]) < 5 * MM


@pytest.mark.slow
def test_snapshot_of_delivering_agv_resumes_bit_for_bit(floor: Floor) -> None:
    lay_kit(floor)
    floor.run(1.5)
    floor.cell.agvs[1].send("kit")
    floor.run(4.0)
    snapshot = take_snapshot(floor.simulation)
    hashes = []
    for _ in range(2):
        floor.run(8.0)
        hashes.append(floor.cell.state_hash())
        restore_snapshot(floor.simulation, snapshot)
        assert floor.cell.agvs[1].state == "delivering"
    assert hashes[0] == hashes[1]


def test_reset_returns_agv_to_station(floor: Floor) -> None:
    fresh = floor.cell.state_hash()
    floor.cell.agvs[1].send("kit")
    floor.run(3.0)
    floor.reset()
    assert floor.cell.state_hash() == fresh
    floor.run(2.0)
    assert floor.cell.agvs[1].state == "ready_to_deliver"
    assert math.dist(floor.body_pose("agv1").position, (0.3, 3.3, 0.0)) < 0.01 * MM


def test_unknown_event_is_refused(floor: Floor) -> None:
    with pytest.raises(CellwrightError, match="does not know the event 'fly'"):
        floor.cell.agvs[1].handle("fly", ())
