"""Collision culling in the running cell: what is closed, what opens in time, and that nothing else changes."""

from dataclasses import replace
from functools import partial

import mujoco
import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.collision_culling import CollisionCulling
from cellwright.cell.devices.moving_bodies import SHORTEST
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import CellSettings
from cellwright.engine.snapshot import renew_engine, restore_snapshot, take_snapshot
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, OVER_BINS, Floor, down, named, one_of_each
from tests.support.places import BELT_SURFACE, BIN_SURFACE, TRAY_SURFACE

GEAR, DISK, PISTON = named("gear_part"), named("disk_part"), named("piston_rod_part")
BELT_X = 1.21
GATE = """
cellwright:
  furniture:
    - name: gate
      pose: {xyz: [1.21, 0, 0.965]}
      shapes: [{box: [0.8, 0.1, 0.1]}]
"""


def culling(floor: Floor) -> CollisionCulling:
    assert floor.cell.culling is not None
    return floor.cell.culling


def body(floor: Floor, name: str) -> int:
    return int(floor.model.body(name).id)


def are_contacts_off(floor: Floor) -> bool:
    return bool(floor.model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT))


def is_gone(floor: Floor, name: str) -> bool:
    return name not in floor.cell.parts.in_play


def without(floor: Floor) -> Floor:
    """Return the same cell without culling, at the start of a run."""
    settings = replace(floor.cell.trial.settings, collision_culling=False)
    return Floor(replace(floor.cell.trial, settings=settings))


def ride(floor: Floor, name: str = GEAR, y: float = 2.0, power: float = 100.0) -> int:
    """Lay a part on the running belt and wait until it is a passenger; return its body."""
    floor.cell.conveyors["belt"].set_power(power)
    floor.lay(name, BELT_X, y, BELT_SURFACE)
    part = floor.part(name)
    floor.run_until(lambda: part.body in culling(floor).passengers, 1.0)
    return part.body


def grip(floor: Floor) -> str:
    """Grip the gear in a bin, without an overlap; return its name."""
    floor.lay(GEAR, -0.3, 0.23, BIN_SURFACE)
    floor.run(0.3)
    floor.set_cup(down(-0.3, 0.23, BIN_SURFACE + 0.0118))
    floor.gripper.set_enabled(True)
    floor.run_until(lambda: floor.gripper.attached, 0.25)
    return GEAR


def test_cell_at_rest_is_closed_and_has_no_contacts(floor: Floor) -> None:
    floor.run(1.0)
    assert are_contacts_off(floor)
    assert floor.simulation.data.ncon == 0
    assert {body(floor, name) for name in ("bin3", "agv1", "conveyor_belt", GEAR)} <= culling(floor).closed
    assert body(floor, "vacuum_gripper_link") not in culling(floor).closed


def test_setting_switches_culling_off(floor: Floor) -> None:
    other = without(floor)
    other.run(0.5)
    assert other.cell.culling is None
    assert other.model.body_contype[body(other, "bin3")] == 1
    assert Cell(replace(floor.cell.trial, settings=CellSettings())).culling is not None


def test_bin_under_arm_opens_before_arm_touches_part(floor: Floor) -> None:
    floor.lay(GEAR, -0.3, 0.23, BIN_SURFACE)
    floor.lay(DISK, -1.0, -1.33, BIN_SURFACE)
    floor.set_cup(down(-0.3, 0.23, BIN_SURFACE + 0.3))
    floor.run(1.0)
    assert {body(floor, "bin7"), body(floor, GEAR), body(floor, "bin1")} <= culling(floor).closed
    floor.swing(floor.reach(down(-0.3, 0.23, BIN_SURFACE - 0.005)), 0.8)
    closed_at = open_at = touched_at = 0
    while not touched_at:
        floor.cell.step()
        tick = floor.simulation.clock.tick
        if body(floor, GEAR) in culling(floor).closed:
            closed_at = tick
        elif not open_at:
            open_at = tick
        bodies = floor.model.geom_bodyid[floor.simulation.data.contact.geom]
        if (bodies == body(floor, "vacuum_gripper_link")).any():
            touched_at = tick
    assert closed_at < open_at
    assert touched_at - open_at >= SHORTEST
    assert body(floor, DISK) in culling(floor).closed
    assert not are_contacts_off(floor)


def test_dive_into_full_bin_is_same_as_without_culling(floor: Floor) -> None:
    ends = []
    for each in (floor, without(floor)):
        for name, x, y in ((GEAR, -0.3, 0.23), (DISK, -0.35, 0.4), (PISTON, -0.2, 0.05)):
            each.lay(name, x, y, BIN_SURFACE)
        each.put_arm(OVER_BINS)
        each.run(1.0)
        each.swing(each.reach(down(-0.3, 0.25, BIN_SURFACE - 0.03)), 0.3)
        each.run(1.5)
        ends.append(each.simulation.data.qpos.copy())
    assert (ends[0] == ends[1]).all()


def test_rider_becomes_passenger_with_velocity_of_belt(floor: Floor) -> None:
    gear = ride(floor)
    before, start = floor.pose(GEAR), floor.now
    floor.run(5.0)
    assert culling(floor).gliders == (gear,)
    assert floor.velocity(GEAR).tolist() == pytest.approx([0.0, -0.2, 0.0, 0.0, 0.0, 0.0], abs=1e-12)
    moved = np.subtract(floor.pose(GEAR).position, before.position)
    assert moved.tolist() == pytest.approx([0.0, -0.2 * (floor.now - start), 0.0], abs=1e-9)


def test_rider_is_where_it_is_without_culling(floor: Floor) -> None:
    places = []
    for each in (floor, without(floor)):
        each.cell.conveyors["belt"].set_power(100.0)
        each.lay(DISK, BELT_X, 6.0, BELT_SURFACE)
        each.run(20.0)
        places.append(each.pose(DISK).position)
    assert places[0] == pytest.approx(places[1], abs=1e-6)


def test_rider_leaves_belt_at_its_end_as_without_culling(floor: Floor) -> None:
    ways = []
    for each in (floor, without(floor)):
        each.cell.conveyors["belt"].set_power(100.0)
        each.lay(PISTON, 1.45, -3.2, BELT_SURFACE)
        ways.append(each.run_until(partial(is_gone, each, PISTON), 10.0))
    assert ways[0] == ways[1]


def test_belt_that_stops_takes_passengers_with_it(floor: Floor) -> None:
    gear = ride(floor)
    floor.cell.conveyors["belt"].set_power(0.0)
    floor.cell.step()
    assert gear not in culling(floor).passengers
    floor.run(1.0)
    assert floor.asleep(gear)
    assert gear in culling(floor).closed
    y = floor.pose(GEAR).position[1]
    floor.cell.conveyors["belt"].set_power(50.0)
    floor.run(2.0)
    assert culling(floor).gliders == (gear,)
    assert y - floor.pose(GEAR).position[1] == pytest.approx(0.2, abs=2 * MM)


def test_part_placed_before_rider_stops_its_glide(floor: Floor) -> None:
    gear = ride(floor)
    x, y, z = floor.pose(GEAR).position
    floor.place(DISK, Pose((x, y - 0.115, z + 0.001)))
    floor.cell.step()
    assert gear not in culling(floor).passengers
    floor.run(2.0)
    assert {gear, body(floor, DISK)} == set(culling(floor).gliders)  # both ride on, without a collision


def test_rider_is_stopped_by_furniture_over_belt() -> None:
    trial = replace(one_of_each(), furniture=load_trial(text=GATE).trial.furniture)
    floor = Floor(trial).reset()
    gear = ride(floor, y=1.0)
    floor.run_until(lambda: gear not in culling(floor).passengers, 6.0)
    edge = floor.pose(GEAR).position[1] - 0.0392
    assert 0.05 < edge < 0.09
    floor.run(3.0)
    assert floor.pose(GEAR).position[1] - 0.0392 == pytest.approx(0.05, abs=2 * MM)


def test_belt_carries_passenger_along_whose_velocity_was_written(floor: Floor) -> None:
    ride(floor)
    floor.simulation.data.qvel[floor.part(GEAR).dof + 1] = -0.1
    floor.run(0.2)
    assert floor.velocity(GEAR)[1] == pytest.approx(-0.2, abs=1e-4)


def test_push_on_passenger_acts_in_same_step(floor: Floor) -> None:
    gear = ride(floor)
    floor.simulation.data.xfrc_applied[gear, 2] = 10.0
    floor.cell.step()
    assert gear not in culling(floor).passengers
    assert floor.velocity(GEAR)[2] == pytest.approx((10.0 / 0.5 - 9.81) * 0.002, rel=0.2)
    floor.simulation.data.xfrc_applied[gear, 2] = 0.0
    floor.run(2.0)
    assert gear in culling(floor).passengers


def test_push_on_part_in_closed_bin_opens_it(floor: Floor) -> None:
    floor.lay(GEAR, -0.3, 0.23, BIN_SURFACE)
    floor.run(1.0)
    gear = body(floor, GEAR)
    assert gear in culling(floor).closed
    floor.simulation.data.xfrc_applied[gear, 2] = -5.0
    floor.run(0.2)
    assert not culling(floor).closed & {gear, body(floor, "bin7")}
    assert floor.pose(GEAR).position[2] == pytest.approx(BIN_SURFACE, abs=0.5 * MM)


def test_force_on_joint_of_closed_part_opens_everything(floor: Floor) -> None:
    floor.lay(GEAR, -0.3, 0.23, BIN_SURFACE)
    floor.run(1.0)
    part = floor.part(GEAR)
    floor.simulation.data.qfrc_applied[part.dof] = 1.0
    floor.run(0.1)
    floor.simulation.data.qfrc_applied[part.dof] = 0.0
    floor.run(1.0)
    assert floor.pose(GEAR).position[2] == pytest.approx(BIN_SURFACE, abs=0.5 * MM)
    assert part.body in culling(floor).closed


def test_held_part_in_free_air_is_passenger(floor: Floor) -> None:
    name = grip(floor)
    part = floor.part(name)
    assert part.body not in culling(floor).passengers  # it still touches the bin
    floor.swing(floor.reach(down(-0.3, 0.23, BIN_SURFACE + 0.3)), 1.0)
    floor.run(2.0)
    assert culling(floor).passengers == {part.body: body(floor, "vacuum_gripper_link")}
    assert are_contacts_off(floor)
    in_cup = floor.cup().inverse() @ floor.pose(name)
    floor.swing(floor.reach(down(-0.3, 0.23, BIN_SURFACE + 0.02)), 0.5)
    floor.run(1.0)
    assert part.body not in culling(floor).passengers
    assert (floor.cup().inverse() @ floor.pose(name)).position == pytest.approx(in_cup.position, abs=0.1 * MM)


def test_released_part_falls_onto_what_is_below(floor: Floor) -> None:
    name = grip(floor)
    floor.swing(floor.reach(down(-0.3, 0.23, BIN_SURFACE + 0.3)), 1.0)
    floor.run(2.0)
    floor.gripper.set_enabled(False)
    floor.run(1.5)
    assert floor.pose(name).position[2] == pytest.approx(BIN_SURFACE, abs=0.5 * MM)


def test_kit_on_moving_agv_is_locked_without_contacts(floor: Floor) -> None:
    floor.lay(GEAR, 0.3, 3.15, TRAY_SURFACE)
    floor.lay(DISK, 0.45, 3.15, TRAY_SURFACE)
    floor.run(1.5)
    assert floor.cell.agvs[1].send("kit")
    floor.run(3.0)
    tray = body(floor, floor.cell.trays[1].link)
    assert culling(floor).passengers == {body(floor, GEAR): tray, body(floor, DISK): tray}
    held = floor.cell.trays[1].world_T_tray.inverse() @ floor.pose(DISK)
    assert held.position == pytest.approx((0.15, 0.0, TRAY_SURFACE - 0.75), abs=0.5 * MM) or held.position[2] > 0.0
    floor.run(20.0)
    assert not culling(floor).passengers


def test_overlapping_rider_keeps_its_contact(floor: Floor) -> None:
    floor.cell.conveyors["belt"].set_power(100.0)
    floor.lay(GEAR, BELT_X, 3.0, BELT_SURFACE, above=-2 * MM)
    floor.run(3.0)
    assert body(floor, GEAR) not in culling(floor).passengers
    assert floor.pose(GEAR).position[1] == pytest.approx(2.4, abs=0.01)


def test_position_written_directly_is_noticed_in_next_step(floor: Floor) -> None:
    floor.lay(GEAR, -0.3, 0.23, BIN_SURFACE)
    floor.put_arm(OVER_BINS)
    floor.run(1.0)
    floor.set_cup(down(-0.3, 0.23, BIN_SURFACE + 0.012))
    floor.cell.step()
    assert not culling(floor).closed & {body(floor, GEAR), body(floor, "bin7")}


@pytest.mark.parametrize("seconds", [0.31, 1.0, 2.222])
def test_snapshot_restores_what_is_closed_bit_for_bit(floor: Floor, seconds: float) -> None:
    floor.lay(PISTON, BELT_X, 4.0, BELT_SURFACE)
    floor.lay(DISK, BELT_X, 3.0, BELT_SURFACE)
    floor.cell.conveyors["belt"].set_power(100.0)
    grip(floor)
    floor.swing(OVER_BINS, 1.0)
    floor.run(seconds)
    moment = take_snapshot(floor.simulation)
    floor.run(1.5)
    expected = floor.cell.state_hash()
    other = Floor(floor.cell.trial)
    for each in (floor, other):
        restore_snapshot(each.simulation, moment)
        each.run(1.5)
        assert each.cell.state_hash() == expected


def test_checkpoint_opens_everything(floor: Floor) -> None:
    gear = ride(floor)
    floor.lay(DISK, -0.3, 0.23, BIN_SURFACE)
    floor.run(1.0)
    places = {name: floor.pose(name).position for name in (DISK, PISTON)}
    renew_engine(floor.simulation)
    assert not culling(floor).closed
    assert not culling(floor).passengers
    floor.run(1.0)
    assert gear in culling(floor).passengers
    for name, place in places.items():
        assert floor.pose(name).position == pytest.approx(place, abs=0.01 * MM)


def test_refreshing_positions_changes_nothing(floor: Floor) -> None:
    hashes = []
    for refreshes in (False, True):
        floor.reset()
        floor.lay(GEAR, BELT_X, 3.0, BELT_SURFACE)
        floor.cell.conveyors["belt"].set_power(100.0)
        floor.put_arm(OVER_BINS)
        floor.swing(floor.reach(down(-0.3, 0.23, BIN_SURFACE + 0.05)), 1.0)
        for tick in range(1000):
            if refreshes:
                floor.simulation.refresh()
            if tick == 600:
                floor.simulation.wake(body(floor, DISK))
                floor.cell.agvs[1].send("kit")
                if refreshes:
                    floor.simulation.refresh()
            floor.cell.step()
        hashes.append(floor.cell.state_hash())
    assert hashes[0] == hashes[1]
