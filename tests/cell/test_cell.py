"""Cell as a whole: the same run everywhere, with any subscribers, and from any checkpoint."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import CompetitionState
from cellwright.clients.client import Client
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import Options, Trial
from cellwright.engine.clock import nanoseconds
from cellwright.engine.snapshot import (
    CheckpointError,
    read_checkpoint,
    restore_snapshot,
    take_snapshot,
    write_checkpoint,
)
from cellwright.running.run import RunOptions, Session
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.support.cells import ARM_ONLY, BARE, KITTING, SENSORS, WHOLE, Ear, run, start, with_seed
from tests.support.scenario import END, MIDDLE, TRIAL, listen_to_all, play
from tests.support.waiting import TIMEOUT
from tests.support.warm import WarmStart

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def reference() -> str:
    """State hash at the end of the scenario."""
    return play(Cell(TRIAL)).state_hash()


def run_in_process(*arguments: str) -> str:
    """Return what another process prints of the scenario."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
    command = [sys.executable, "-m", "tests.support.scenario", *arguments]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=TIMEOUT, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_scenario_covers_all_devices() -> None:
    """The tests below rely on these events."""
    cell = play(Cell(TRIAL), MIDDLE)
    assert (cell.arm, cell.gripper) != (None, None)
    assert cell.agvs[1].state == "delivering"
    assert cell.gripper is not None
    assert cell.gripper.part == "bin7|piston_rod_part_5"
    assert cell.arm is not None
    assert cell.arm.controller.goal is not None
    assert cell.arm.controller.goal.active
    assert cell.competition.referee.active_orders == ["order_0"]
    assert [each.order_id for each in cell.competition.announced] == ["order_0", "order_1"]
    assert cell.competition.score().total == 2.0  # two gears, of which one is faulty, so one for presence and pose
    assert any(part.startswith("populate_conveyor") for part in cell.parts.in_play)
    play(cell)
    assert cell.competition.state is CompetitionState.GO
    assert cell.gripper.lost_reason == "released"


@pytest.mark.slow
def test_run_in_two_processes_has_same_state_hash(reference: str) -> None:
    assert run_in_process() == run_in_process("--listen") == reference


@pytest.mark.slow
def test_subscribers_change_no_state_hash(reference: str) -> None:
    cell = Cell(TRIAL, competition=False)
    heard = listen_to_all(cell)
    assert play(cell).state_hash() == reference
    assert len(heard) > 10_000


def test_subscribing_and_leaving_changes_no_state_hash(reference: str) -> None:
    cell = Cell(TRIAL)
    names = [topic.name for topic in cell.bus.topics()]
    for number in range(40):
        ears = [Ear(cell, name) for name in names[number % 3 :: 3]]
        play(cell, (number + 1) * END / 40)
        for ear in ears:
            ear.cancel()
    assert cell.state_hash() == reference


@pytest.mark.slow
def test_seed_changes_sensor_noise_only() -> None:
    """No device decides anything by a random draw: all randomness is noise of sensors."""
    found = []
    states = []
    for seed in (0, 1):
        cell = Cell(with_seed(TRIAL, seed))
        camera = Ear(cell, "logical_camera_1")
        simulation = play(cell).simulation
        state = simulation.get_state()
        del state["devices"]["/ariac"]  # the newest message of each latched topic
        states.append((simulation.data.qpos.tobytes(), simulation.data.qvel.tobytes(), state))
        found.append([(each.pose.position.x, each.pose.position.y) for each in camera.messages[3].models])
    assert states[0] == states[1]
    assert found[0] != found[1]
    cell = Cell(TRIAL, seed=1)
    assert cell.seed == 1
    camera = Ear(cell, "logical_camera_1")
    play(cell, 1.0)
    assert [(each.pose.position.x, each.pose.position.y) for each in camera.messages[3].models] == found[1]


def test_state_hash_differs_between_runs() -> None:
    cell = Cell(KITTING)
    run(cell, 0.1)
    before = cell.state_hash()
    assert cell.state_hash() == before
    cell.step()
    assert cell.state_hash() != before
    assert Cell(KITTING).state_hash() == Cell(KITTING, competition=False).state_hash()
    assert Cell(KITTING).state_hash() != Cell(replace(KITTING, extra_parts=())).state_hash()


@pytest.mark.slow
def test_reset_cell_equals_new_cell(reference: str) -> None:
    cell = Cell(TRIAL)
    listen_to_all(cell)
    new = cell.state_hash()
    play(cell, 3.3)
    cell.reset()
    assert cell.simulation.now == 0
    assert cell.state_hash() == new
    assert play(cell).state_hash() == reference


@pytest.mark.slow
def test_snapshot_is_restored_and_disturbs_nothing(reference: str) -> None:
    cell = play(Cell(TRIAL), MIDDLE)
    moment = take_snapshot(cell.simulation)
    then = cell.state_hash()
    assert play(cell).state_hash() == reference
    restore_snapshot(cell.simulation, moment)
    assert cell.state_hash() == then
    assert play(cell).state_hash() == reference


@pytest.mark.slow
def test_snapshot_resumes_in_other_cell(reference: str) -> None:
    moment = take_snapshot(play(Cell(TRIAL), MIDDLE).simulation)
    other = Cell(TRIAL)
    play(other, 1.5)  # has a history of its own
    restore_snapshot(other.simulation, moment)
    heard = listen_to_all(other)
    assert play(other).state_hash() == reference
    assert heard


def test_snapshots_are_restored_in_reverse_order() -> None:
    cell = Cell(TRIAL)
    moments = []
    for number in range(1, 8):
        play(cell, number * 0.5)
        moments.append((take_snapshot(cell.simulation), cell.state_hash(), cell.competition.score()))
    for moment, state, score in reversed(moments):
        restore_snapshot(cell.simulation, moment)
        assert (cell.state_hash(), cell.competition.score()) == (state, score)


@pytest.mark.slow
def test_checkpoint_resumes_in_this_and_other_process(tmp_path: Path, warm: WarmStart) -> None:
    file = tmp_path / "middle.npz"
    cell = play(Cell(TRIAL), MIDDLE)
    write_checkpoint(cell.simulation, file)
    here = play(cell).state_hash()
    other = Cell(TRIAL)
    read_checkpoint(other.simulation, file)
    assert other.simulation.now == nanoseconds(MIDDLE)
    assert play(other).state_hash() == here
    command = [sys.executable, "-m", "tests.support.scenario", "--continue", str(file), "--listen"]
    there = warm.popen(command, folder=ROOT, environment={**os.environ, "PYTHONPATH": str(ROOT)})
    assert there.communicate() == (f"{here}\n", "")


@pytest.mark.slow
def test_declared_checkpoint_is_part_of_run(tmp_path: Path, reference: str) -> None:
    file = tmp_path / "middle.npz"
    cell = Cell(TRIAL)
    cell.checkpoints.declare(nanoseconds(MIDDLE), file)
    cell.reset()
    here = play(cell).state_hash()
    assert here != reference  # the time of saving is part of a run
    other = Cell(TRIAL)
    read_checkpoint(other.simulation, file)
    assert play(other).state_hash() == here


def test_checkpoint_of_other_cell_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.npz"
    write_checkpoint(Cell(ARM_ONLY).simulation, file)
    with pytest.raises(CheckpointError, match="made with another cell"):
        read_checkpoint(Cell(BARE).simulation, file)


def test_cell_has_devices_of_its_trial() -> None:
    bare = Cell(BARE)
    assert (bare.arm, bare.gripper, bare.demo_tray) == (None, None, None)
    assert (bare.populations, bare.senders) == ({}, {})
    assert (bare.trays, bare.agvs, bare.sensors, bare.quality) == ({}, {}, {}, {})
    whole = Cell(WHOLE)
    assert whole.sensors.keys() == {sensor.name for sensor in SENSORS}
    assert (set(whole.trays), set(whole.agvs), set(whole.quality)) == ({1, 2}, {1, 2}, {1, 2})
    assert whole.drawn == (whole.simulation.model, whole.world.visuals)


@pytest.mark.slow
def test_servo_argument_overrides_servo_profile() -> None:
    assert Cell(ARM_ONLY).servo == "original"
    precise = Cell(ARM_ONLY, servo="precise")
    assert precise.servo == precise.trial.settings.arm.servo == "precise"
    soft = Cell(ARM_ONLY)
    for cell in (soft, precise):
        run(cell, 1.0)
    assert soft.state_hash() != precise.state_hash()


def test_cell_without_agvs_runs_competition() -> None:
    cell = Cell(Trial("empty", options=Options(insert_agvs=False), orders=KITTING.orders))
    start(cell)
    run(cell, 1.0)
    assert cell.competition.state is CompetitionState.GO


def test_sensor_with_topic_name_of_cell_is_refused() -> None:
    with pytest.raises(
        UsageError, match=r"sensor 'orders': topic /ariac/orders already has type .* \(got sensor_msgs/Range\)"
    ):
        Cell(replace(BARE, sensors=(SensorConfig("orders", "proximity_sensor", Pose()),)))


def test_run_continued_from_snapshot_ends_as_one_that_went_on(reference: str) -> None:
    cell = play(Cell(TRIAL), MIDDLE)
    taken = cell.snapshot()
    assert play(cell).state_hash() == reference
    for _ in range(2):
        cell.restore(taken)
        assert (cell.simulation.time, taken.time) == (MIDDLE, MIDDLE)
        assert play(cell).state_hash() == reference


def test_snapshot_is_restored_in_another_cell_and_after_another_start(reference: str) -> None:
    taken = play(Cell(TRIAL), MIDDLE).snapshot()
    other = Cell(TRIAL, seed=4)
    other.reset(seed=9, variation=True, joints={"elbow_joint": 1.0})
    play(other, 1.0)
    other.restore(taken)
    assert (other.seed, other.trial) == (0, TRIAL)
    assert play(other).state_hash() == reference


@pytest.mark.parametrize(
    "other", [Cell(BARE), Cell(TRIAL, servo="precise"), Cell(TRIAL, competition=False)], ids=["trial", "servo", "mode"]
)
def test_snapshot_of_another_cell_is_refused(other: Cell) -> None:
    cell = Cell(TRIAL)
    before = cell.state_hash()
    with pytest.raises(UsageError, match="the snapshot is one of another cell"):
        cell.restore(other.snapshot())
    assert cell.state_hash() == before


def test_client_knows_in_restored_run_what_it_knew() -> None:
    cell = Cell(TRIAL)
    client = Client.in_process(cell)
    camera = client.sensor("logical_camera_1")
    client.start_competition()
    client.sleep(0.3)

    def known() -> list[object]:
        states = client.joint_states
        return [
            client.time,
            [each.order_id for each in client.orders],
            client.competition_state,
            (states.count, repr(states.message)),
            (camera.count, repr(camera.message)),
        ]

    before, taken = known(), cell.snapshot()
    client.sleep(0.5)
    later = known()
    late = Client.in_process(cell)
    late.sleep(0.1)
    assert len(client.orders) == 2
    cell.restore(taken)
    assert known() == before
    assert (late.competition_state, late.joint_positions) == ("", {})
    client.sleep(0.5)
    assert known() == later
    late.sleep(0.002)  # messages come while it lets time pass
    assert [each.order_id for each in late.orders] == ["order_0", "order_1"]  # the latched one, and the next


def test_restore_within_tick_and_of_recorded_run_is_refused(tmp_path: Path) -> None:
    with Session(TRIAL, record=tmp_path / "run.mcap") as session:
        session.client().sleep(0.1)
        with pytest.raises(UsageError, match="one course of time"):
            session.node.restore(session.node.snapshot())
    cell = Cell(TRIAL)
    taken = cell.snapshot()
    cell.bus.subscribe("/clock", lambda _message: cell.restore(taken))
    with pytest.raises(UsageError, match="call them after the step"):
        cell.step()


def test_restored_run_of_session_ends_at_its_own_limit() -> None:
    with Session(KITTING, options=RunOptions(until=3.0)) as session:
        client = session.client()
        assert isinstance(client, Client)
        client.start_competition()
        client.sleep(0.1)
        before = session.node.snapshot()
        client.end_competition()  # which limits the run
        client.sleep(0.1)
        session.node.restore(before)
        client.sleep(2.8)
        assert client.competition_state == "go"
