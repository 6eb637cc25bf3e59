"""Distances between arms and robots, and the guard that stops arms before they come too near."""

import mujoco
import pytest

from cellwright import Cell, Client
from cellwright.cell.devices.arm_guard import ArmDistances
from cellwright.clients.client import ClientArm
from cellwright.config.trial.gear2017 import load_trial
from cellwright.running.run.collisions import CollisionWatch
from tests.cell.arm_cells import TWO_ON_A_RAIL
from tests.cell.robot_cells import BESIDE_ARM

RAIL = "linear_arm_actuator_joint"
CLEARANCE = 0.1
GUARDED = TWO_ON_A_RAIL.replace("cell:\n", f"cell:\n  arm_clearance: {CLEARANCE}\n")


def slide(arm: ClientArm, rail: float, duration: float) -> None:
    """Send an arm along the rail [m], with its other joints as they are."""
    joints = {name: value for name, value in arm.joint_positions.items() if name != "vacuum_gripper_joint"}
    arm.send_arm([list((joints | {RAIL: rail}).values())], [duration], joints=[*joints])


def opened(text: str) -> tuple[Cell, Client, list[ClientArm], list[str]]:
    """Return a cell with two arms, a client, the arms, and a list that what the cell reports comes into."""
    lines: list[str] = []
    cell = Cell(load_trial(text=text).trial, report=lines.append)
    client = Client.in_process(cell)
    arms = [client.arm(name) for name in cell.arms]
    client.sleep(0.1)
    return cell, client, arms, lines


def test_distance_is_the_smallest_of_all_pairs_of_shapes() -> None:
    cell, client, arms, _ = opened(TWO_ON_A_RAIL)
    slide(arms[0], -0.2, 1.0)
    client.sleep(1.5)
    model, data = cell.simulation.model, cell.simulation.data
    geoms = [
        [geom for geom in range(model.ngeom) if model.body(int(model.geom_bodyid[geom])).name.startswith(f"{arm}/")]
        for arm in cell.arms
    ]
    moving = [
        [geom for geom in each if "actuator" not in model.body(int(model.geom_bodyid[geom])).name] for each in geoms
    ]
    solid = [[geom for geom in each if model.geom_contype[geom]] for each in moving]
    cell.simulation.refresh()
    every = [mujoco.mj_geomDistance(model, data, one, other, 10.0, None) for one in solid[0] for other in solid[1]]
    found = ArmDistances(cell.simulation, cell.trial).nearest("arm1", "arm2")
    assert found is not None
    assert found.distance == min(every)
    assert ArmDistances(cell.simulation, cell.trial).nearest("arm1", "arm2", within=found.distance) is None


@pytest.mark.parametrize("duration", [1.0, 3.0])
def test_guard_stops_arms_that_approach_and_keeps_the_clearance(duration: float) -> None:
    cell, client, arms, lines = opened(GUARDED)
    watch = CollisionWatch(cell)
    slide(arms[0], 0.6, duration)
    slide(arms[1], -0.6, duration)
    client.sleep(duration + 1.0)
    assert watch.nearest is not None
    assert CLEARANCE - 0.015 < watch.nearest.distance < CLEARANCE + 0.05
    assert watch.end() == []
    assert [line for line in lines if line.startswith("arm_clearance: arm1 and arm2 stopped: arm1_")]
    rails = [arm.joint_positions[RAIL] for arm in arms]
    client.sleep(0.5)
    assert [arm.joint_positions[RAIL] for arm in arms] == pytest.approx(rails, abs=2e-3)


def test_stopped_arm_may_go_back_and_not_on() -> None:
    cell, client, arms, _ = opened(GUARDED)
    slide(arms[0], 0.9, 2.0)
    client.sleep(3.0)
    stopped = arms[0].joint_positions[RAIL]
    assert stopped < 0.8
    assert arms[1].joint_positions[RAIL] == pytest.approx(1.2, abs=2e-3)
    slide(arms[0], 0.9, 1.0)
    client.sleep(2.0)
    assert arms[0].joint_positions[RAIL] < stopped + 0.05
    slide(arms[0], -0.5, 1.0)
    client.sleep(2.0)
    assert arms[0].joint_positions[RAIL] == pytest.approx(-0.5, abs=0.01)
    assert cell.arm_guard is not None
    state = cell.arm_guard.get_state()
    assert set(state) == {"halted"}


def test_run_continues_alike_from_a_snapshot_at_a_stop() -> None:
    cell, client, arms, _ = opened(GUARDED)
    slide(arms[0], 0.9, 2.0)
    client.sleep(1.2)
    kept = cell.snapshot()
    cell.simulation.step_until(3_000_000_000)
    first = cell.state_hash()
    cell.restore(kept)
    cell.simulation.step_until(3_000_000_000)
    assert cell.state_hash() == first


def test_guard_stops_an_arm_before_a_robot() -> None:
    text = BESIDE_ARM.replace("cell:\n", f"cell:\n  arm_clearance: {CLEARANCE}\n")
    lines: list[str] = []
    cell = Cell(load_trial(text=text).trial, report=lines.append)
    client, watch = Client.in_process(cell), CollisionWatch(cell)
    client.sleep(0.1)
    joints = {name: value for name, value in client.joint_positions.items() if name != "vacuum_gripper_joint"}
    client.send_arm([list((joints | {RAIL: 1.5}).values())], [2.0], joints=[*joints])
    client.sleep(3.0)
    assert watch.nearest is not None
    assert watch.nearest.other.startswith("tandem_")
    assert CLEARANCE - 0.015 < watch.nearest.distance < CLEARANCE + 0.05
    (line,) = lines
    assert line.startswith("arm_clearance: arm stopped: forearm_link would be ")
    assert " mm from tandem_" in line
