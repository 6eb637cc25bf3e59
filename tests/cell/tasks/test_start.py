"""Start of a task: posture, held part, and the competition that starts without a client."""

from dataclasses import replace

import pytest

from cellwright import Cell
from cellwright.clients.client.client import Client
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.task import TaskStart
from tests.cell.tasks.cells import go, task_cell, trial

LIFT = "{held: {part: gear_part, lifted: 0.1}}"
WITHOUT_ORDER = """
cell: {bins: {bin1: {at: [-0.35, 0.0]}}, arms: {arm: {mount: {kind: rail, at: [0.3, 0, 0.9]}}}}
parts: [{type: gear_part, in: bin1}]
time_limit: 0.5
task: {sentence: Lift it., success: {held: {part: gear_part, lifted: 0.1}}}
"""


def positions(cell: Cell) -> dict[str, float]:
    assert cell.arm is not None
    return dict(zip(cell.arm.joints, cell.arm.read().positions, strict=True))


def test_competition_starts_without_a_client() -> None:
    cell = task_cell(LIFT)
    go(cell, 0.1)
    assert cell.competition.state == "go"
    assert not Client.in_process(cell).start_competition()


def test_client_starts_the_competition_if_the_task_says_so() -> None:
    cell = task_cell(LIFT, "  starts_competition: false\n")
    go(cell, 0.1)
    assert cell.competition.state == "init"
    assert Client.in_process(cell).start_competition()


def test_task_without_order_goes_on_until_its_time_limit() -> None:
    cell = Cell(load_trial(text=WITHOUT_ORDER).trial)
    go(cell, 0.45)
    assert cell.competition.state == "go"
    go(cell, 0.1)
    assert cell.competition.state == "done"
    assert cell.competition.is_timed_out


def test_joints_begin_as_written() -> None:
    cell = task_cell(LIFT, "  start: {joints: {elbow_joint: pi/2, wrist_3_joint: 0.3}}\n")
    assert positions(cell)["elbow_joint"] == pytest.approx(1.5708, abs=1e-4)
    assert positions(cell)["wrist_3_joint"] == 0.3
    usual = positions(task_cell(LIFT))
    assert positions(cell)["shoulder_lift_joint"] == usual["shoulder_lift_joint"]


def test_jitter_follows_the_seed() -> None:
    jitter = "  start: {joints: {elbow_joint: 1.5}, jitter: 0.05}\n"
    cell = task_cell(LIFT, jitter, seed=3)
    first, usual = positions(cell), positions(task_cell(LIFT, "  start: {joints: {elbow_joint: 1.5}}\n"))
    assert all(0.0 < abs(first[name] - usual[name]) <= 0.05 for name in usual)
    assert positions(task_cell(LIFT, jitter, seed=4)) != first
    cell.reset(seed=4)
    again = positions(cell)
    assert again == positions(task_cell(LIFT, jitter, seed=4))
    cell.reset(seed=3)
    assert positions(cell) == first
    cell.reset(joints={"elbow_joint": 1.0})
    assert positions(cell)["elbow_joint"] == 1.0
    assert positions(cell)["wrist_3_joint"] == first["wrist_3_joint"]


def test_jitter_stays_within_the_limits() -> None:
    written = trial(LIFT, "  start: {joints: {linear_arm_actuator_joint: 2.1}, jitter: 1}\n")
    upper = written.joints["linear_arm_actuator_joint"].upper
    found = [positions(Cell(written, seed=seed))["linear_arm_actuator_joint"] for seed in range(4)]
    assert max(found) == upper
    assert min(found) < upper


def robot_positions(cell: Cell) -> dict[str, float]:
    commander = cell.robots["qinglong"].commander
    return {name: float(commander.measured()[number]) for name, number in commander.numbers.items()}


def test_jitter_shifts_the_arms_of_a_robot_by_the_seed() -> None:
    written = load_trial([find_trial("reach")]).trial
    assert written.task is not None
    usual = robot_positions(Cell(replace(written, task=replace(written.task, start=TaskStart()))))
    cell = Cell(written, seed=3)
    first = robot_positions(cell)
    shifts = {name: abs(first[name] - usual[name]) for name in usual if first[name] != usual[name]}
    assert shifts.keys() == written.robot_models["qinglong"].start.keys()
    assert max(shifts.values()) <= 0.05
    cell.reset(seed=4)
    assert robot_positions(cell) == robot_positions(Cell(written, seed=4)) != first
    cell.reset(seed=3)
    assert robot_positions(cell) == first


def test_reset_begins_as_a_new_cell() -> None:
    more = "  start: {jitter: 0.05, holding: gear_part}\n"
    cell = task_cell(LIFT, more, seed=5)
    go(cell, 0.5)
    cell.reset(seed=6, variation=True)
    go(cell, 0.5)
    other = task_cell(LIFT, more, seed=5)
    other.reset(seed=6, variation=True)
    go(other, 0.5)
    assert cell.state_hash() == other.state_hash()


@pytest.mark.parametrize("kind", ["gear_part", "pulley_part"])
def test_cup_holds_a_part_at_the_start(kind: str) -> None:
    cell = task_cell(LIFT, f"  start: {{holding: {kind}}}\n")
    gripper = cell.gripper
    assert gripper is not None
    assert gripper.part == f"bin1|{kind}_1"
    assert gripper.enabled
    part = cell.parts.part(f"bin1|{kind}_1")
    cell.simulation.refresh()
    body = cell.simulation.data.body("vacuum_gripper_link")
    before = body.xpos - cell.parts.pose(part).position
    go(cell, 1.0)
    cell.simulation.refresh()
    after = body.xpos - cell.parts.pose(part).position
    assert after == pytest.approx(before, abs=2e-3)
    assert gripper.part == part.name
    gripper.set_enabled(False)
    go(cell, 1.0)
    assert not gripper.attached
    assert cell.parts.pose(part).position[2] < 0.9
