"""The lesson's own program in the lesson's own cell."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.grippers import Gripper
from cellwright.clients.agents.lesson import BY_BELT, LIFT, PICK, READY, STEP, WAYPOINTS, LessonAgent, changed
from cellwright.clients.client import ARM_JOINTS, Client
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.running.run import Outcome, RunOptions, RunResult, run_cell
from cellwright.util.pose import Pose
from tests.support.cells import Ear


@dataclass
class Record:
    """Observations of a run."""

    cell: Cell
    result: RunResult
    held: list[tuple[float, str]] = field(default_factory=list)
    on_tray: dict[str, Pose] = field(default_factory=dict)
    orders: int = 0
    refused: int = 0


def play(agent: LessonAgent, **options: float) -> Record:
    cell = Cell(load_trial([find_trial("lesson")]).trial)
    assert cell.gripper is not None
    held: list[tuple[float, str]] = []

    def take(gripper: Gripper) -> None:
        if gripper.part is not None:
            held.append((cell.simulation.time, gripper.part))

    cell.gripper.on_change.append(take)
    on_tray: dict[str, Pose] = {}
    cell.agvs[1].on_submit.append(
        lambda agv, _: on_tray.update({each.name: each.pose for each in agv.tray.find_parts()})
    )
    orders = Ear(cell, "orders")
    result = run_cell(cell, agent, RunOptions(**options))  # type: ignore[arg-type]
    return Record(cell, result, held, on_tray, len(orders), cell.bus.refusals.total)


@pytest.fixture(scope="module")
def bin_only() -> Record:
    """The first half of the lesson: two rods from the bin."""
    return play(LessonAgent(from_belt=False))


@pytest.mark.slow
def test_lesson_fetches_two_piston_rods_from_bin_7(bin_only: Record) -> None:
    assert [part for _, part in bin_only.held] == ["bin7|piston_rod_part_5", "bin7|piston_rod_part_6"]
    # 1.5 s to be ready and 1 s to reach for it; the sleeps of one part add up to 6.4 s
    first, second = (time for time, _ in bin_only.held)
    assert 2.0 < first < 3.0
    assert second - first == pytest.approx(6.4, abs=0.3)


def test_lesson_leaves_both_rods_on_tray_of_agv_1(bin_only: Record) -> None:
    """Both are let go at one place, so that one may come to lie on the other; neither falls off."""
    parts = bin_only.cell.parts
    assert bin_only.on_tray.keys() & {"bin7|piston_rod_part_5", "bin7|piston_rod_part_6"}
    for name in ("bin7|piston_rod_part_5", "bin7|piston_rod_part_6"):
        tray_T_rod = bin_only.cell.trays[1].world_T_tray.inverse() @ parts.pose(parts.part(name))
        x, y, z = tray_T_rod.position
        assert abs(x) < 0.25
        assert abs(y) < 0.35
        assert 0.0 < z < 0.1


def test_lesson_ends_with_kit_sent_and_points_for_presence(bin_only: Record) -> None:
    result = bin_only.result
    assert (result.outcome, result.competition_state) == (Outcome.DONE, "done")
    assert bin_only.orders == 1
    kit = result.score.orders[0].kits[0]
    assert kit.is_submitted
    # the ordered places lie beside the tray: presence is all that can be earned
    assert result.score.total in (1.0, 2.0)
    assert result.score.total == sum(each.fit is not None for each in kit.parts)
    assert bin_only.refused == 0
    assert result.error == ""


@pytest.mark.slow
def test_whole_lesson_works_belt_and_ends() -> None:
    record = play(LessonAgent(timeout=12.0))
    assert [part for _, part in record.held][:2] == ["bin7|piston_rod_part_5", "bin7|piston_rod_part_6"]
    assert record.cell.agvs[1].state in ("delivering", "returning")
    assert (record.result.outcome, record.result.competition_state) == (Outcome.DONE, "done")
    assert record.result.simulated < 200.0
    assert record.result.score.orders[0].kits[0].is_submitted


@pytest.mark.slow
def test_lesson_logs_its_actions(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    record = play(LessonAgent(from_belt=False, parts=1))
    assert [part for _, part in record.held] == ["bin7|piston_rod_part_5"]
    assert "fetching piston rod 1 from the bin" in caplog.text
    assert "delivering it (held)" in caplog.text


@pytest.mark.slow
def test_lesson_with_absent_agv_runs_to_its_end() -> None:
    class Busy(LessonAgent):
        def run(self, client: Client) -> None:
            client.call("/ariac/agv1", AGVControlRequest("nothing"))
            super().run(client)

    result = play(Busy(from_belt=False, parts=1), until=20.0).result
    assert result.outcome in (Outcome.UNTIL, Outcome.GAVE_UP)


def test_waypoints_have_seven_joints_and_one_extra_number() -> None:
    assert len(WAYPOINTS) == 11
    assert {len(each) for each in WAYPOINTS} == {len(ARM_JOINTS) + 1}
    assert all(each[-1] == 0.0 for each in WAYPOINTS)


def test_changed_waypoint_differs_in_one_joint() -> None:
    moved = changed(PICK, 1, WAYPOINTS[PICK][1] + STEP)
    assert moved[1] == pytest.approx(0.38)
    assert (*moved[:1], *moved[2:]) == (*WAYPOINTS[PICK][:1], *WAYPOINTS[PICK][2:])
    assert WAYPOINTS[PICK][1] == 0.25
    assert (READY, PICK, LIFT, BY_BELT) == (0, 1, 2, 7)
