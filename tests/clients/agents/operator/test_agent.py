"""A person works whole cells over topics, and is scored, recorded and replayed as a program is."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright import load_trial
from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.agent import OperatorAgent
from cellwright.clients.agents.operator.requests import (
    JOINTS,
    POSE,
    REPORT,
    VELOCITY,
    joints_request,
    pose_request,
    velocity_request,
)
from cellwright.clients.client.client import Client
from cellwright.config.trial.trial import Trial
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import Answer, recorded_steps, verify
from cellwright.running.run import Outcome, RunOptions, RunResult, Session, run_cell
from cellwright.running.run.surroundings import CellSurroundings
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose, Vector3
from tests.cell.arm_cells import TWO_UR5, finger_cell, ur5_cell
from tests.cell.robot_cells import tandem_cell
from tests.clients.agents.operator.person import Person, Plan
from tests.support.cells import ARM_ONLY, order

ONE_ROD = """
cell: {based_on: gear2017}
arm: {type: ur10}
parts: [{type: piston_rod_part, in: bin7, grid: [1, 1]}]
orders: {order_0: {tray: agv1, parts: [{type: piston_rod_part, xy: [0.1, 0.1]}]}}
time_limit: 100
"""
"""The cell of 2017 with an order of one rod."""


def work(trial: Trial, plan: Plan, seconds: float) -> tuple[Cell, Person, RunResult]:
    """Let a person work a cell, who sees its parts."""
    # a competition without an order is over as it begins
    cell = Cell(trial if trial.orders else replace(trial, orders=(order(),)))
    found = Person(cell, plan)
    result = run_cell(cell, OperatorAgent(CellSurroundings(cell)), RunOptions(until=seconds))
    assert result.outcome in (Outcome.DONE, Outcome.UNTIL), result.error
    return cell, found, result


def tool(person: Person, link: str = "vacuum_gripper_link") -> Pose:
    """Return where a tool is."""
    body = person.cell.simulation.data.body(link)
    (x, y, z), (a, b, c, d) = body.xpos.tolist(), body.xquat.tolist()
    return Pose((x, y, z), (a, b, c, d))


def went(person: Person, position: Vector3, link: str = "vacuum_gripper_link") -> Callable[[], bool]:
    """Ask for a place of the tool; return the condition that the arm rests after that."""
    person.publish(POSE, pose_request(Pose(position, tool(person, link).quaternion)))
    later = person.after(0.5)
    return lambda: later() and person.is_idle()


def builds_the_kit(person: Person) -> Iterator[Callable[[], bool]]:
    """Fetch the rod by the aid, put it at its place, and send the AGV."""
    cell = person.cell
    gripper = cell.gripper
    assert gripper is not None
    person.say("start")
    (part,) = (each for each in cell.parts.all if each.name in cell.parts.in_play)
    x, y, _ = cell.parts.pose(part).position
    yield went(person, (x - 0.05, y + 0.02, 0.95))
    person.suck(enable=True)
    person.say("snap")
    yield lambda: gripper.part is not None
    yield went(person, (-0.05, y, 1.0))
    yield went(person, (-0.05, 2.4, 1.0))
    yield went(person, (0.3, 3.15, 1.0))
    agv, (goal,) = cell.trial.carriers[0], cell.trial.orders[0].kits[0].objects
    place = agv.tray_frame @ goal.pose @ cell.parts.pose(part).relative(tool(person))
    x, y, _ = place.position
    for height in (0.85, agv.surface + 0.023):
        person.publish(POSE, pose_request(Pose((x, y, height), place.quaternion)))
        later = person.after(0.5)
        yield lambda later=later: later() and person.is_idle()  # type: ignore[misc]
    person.suck(enable=False)
    yield person.after(1.0)
    yield went(person, (x, y, 1.0))
    cell.bus.call("/ariac/agv1", AGVControlRequest(kit_type="order_0_kit_0"), node="/person")


def rests(person: Person) -> Iterator[Callable[[], bool]]:
    """Ask for nothing."""
    yield person.after(0.3)


@pytest.mark.parametrize(("name", "has_begun"), [("lesson", False), ("pick_from_bin", True)])
def test_competition_begins_with_the_first_request_or_with_the_task(name: str, has_begun: bool) -> None:
    _, person, _ = work(load_trial(name), rests, 0.5)
    assert person.state["begun"] is has_begun


@pytest.mark.slow
def test_person_builds_a_kit_and_is_scored_recorded_and_replayed(tmp_path: Path) -> None:
    path, persons = tmp_path / "run.mcap", list[Person]()
    (tmp_path / "one_rod.yaml").write_text(ONE_ROD)

    def sits_down(session: Session) -> nullcontext[None]:
        persons.append(Person(session.node, builds_the_kit))
        return nullcontext()

    with Session(tmp_path / "one_rod.yaml", record=path, options=RunOptions(observers=[sits_down])) as session:
        result = session.run(OperatorAgent(CellSurroundings(session.node)))
    assert persons[0].is_done
    assert (result.outcome, result.error) == (Outcome.DONE, "")
    assert isinstance(result, RunResult)
    assert result.score.total == 3.0, "there, at its place, and all parts"
    assert result.simulated < 60.0

    with RecordingFile(path) as recording:
        commands = {each.name for each in recorded_steps(recording) if hasattr(each, "name")}
        assert {"/cellwright/operator/pose", "/cellwright/operator/command", "/ariac/arm/command"} <= commands
        with rebuild(recording) as rebuilt:
            verdict = verify(rebuilt, recorded_steps(recording), result=recording.end)
    assert verdict.answer is Answer.EQUAL


def test_requests_without_an_operator_are_refused() -> None:
    cell = Cell(ARM_ONLY)
    with pytest.raises(RejectedCommandError, match=r"no operator works this cell; start it with .*--operator"):
        cell.bus.publish(POSE, pose_request(Pose()))
    cell.bus.publish(REPORT, String("{}"))
    cell.bus.publish(POSE, pose_request(Pose()))
    cell.reset()
    with pytest.raises(RejectedCommandError, match="no operator"):
        cell.bus.publish(POSE, pose_request(Pose()))


def test_competition_begins_with_the_first_motion() -> None:
    def waits(person: Person) -> Iterator[Callable[[], bool]]:
        person.say("upright on")
        yield person.after(1.0)
        assert person.cell.competition.state == "init"
        person.say("home")
        yield person.after(0.1)
        assert person.cell.competition.state == "go"

    _, person, _ = work(ARM_ONLY, waits, 2.0)
    assert person.is_done


def test_stop_holds_all_until_it_is_cleared() -> None:
    def stops(person: Person) -> Iterator[Callable[[], bool]]:
        person.publish(JOINTS, joints_request({"linear_arm_actuator_joint": 2.0}))
        yield person.after(1.0)
        person.say("stop")
        yield person.after(0.5)
        assert person.state["stopped"]
        at = person.arm()["joints"][0]
        assert 0.1 < at < 1.5
        person.publish(JOINTS, joints_request({"linear_arm_actuator_joint": 2.0}))
        yield person.after(0.5)
        assert person.arm()["joints"][0] == pytest.approx(at, abs=5e-3)
        assert "stopped: nothing moves until the command clear" in person.state["note"]
        person.say("clear")
        person.say("home")
        yield person.after(0.2)
        assert person.arm()["mode"] == "going home"
        yield person.is_idle
        assert person.arm()["joints"][0] == pytest.approx(0.0, abs=0.01)

    _, person, _ = work(ARM_ONLY, stops, 8.0)
    assert person.is_done


def test_what_cannot_be_done_is_noted() -> None:
    def asks(person: Person) -> Iterator[Callable[[], bool]]:
        for command, why in {
            "snap": "snap: no part within 0.2 m below the tool",
            "arm gripper": "arm: unknown (got gripper); give one of arm",
            "jump": "command: unknown (got 'jump')",
        }.items():
            person.say(command)
            yield person.after(0.2)
            assert why in person.state["note"]
        yield person.after(6.0)
        assert person.state["note"] == ""

    _, person, _ = work(ARM_ONLY, asks, 8.0)
    assert person.is_done


def test_one_of_several_arms_is_chosen() -> None:
    def chooses(person: Person) -> Iterator[Callable[[], bool]]:
        before = {name: list(person.arm(name)["joints"]) for name in ("arm1", "arm2")}
        person.say("arm arm2")
        for _ in range(10):
            person.publish(VELOCITY, velocity_request((0.0, 0.0, 0.2)))
            yield person.after(0.1)
        yield lambda: person.is_idle("arm2")
        assert person.arm("arm1")["joints"] == pytest.approx(before["arm1"], abs=2e-3)
        assert person.arm("arm2")["joints"] != pytest.approx(before["arm2"], abs=2e-2)
        person.publish(JOINTS, joints_request({"wrist_3_joint": 0.5}))
        yield person.after(1.5)
        assert person.arm("arm1")["joints"][5] == pytest.approx(0.5, abs=5e-3)

    _, person, _ = work(ur5_cell(TWO_UR5), chooses, 6.0)
    assert person.is_done


@pytest.mark.slow
def test_person_kits_with_another_arm_on_a_fixed_tray() -> None:
    def kits(person: Person) -> Iterator[Callable[[], bool]]:
        gripper = person.cell.gripper
        assert gripper is not None
        link = "arm/vacuum_gripper_link"
        yield went(person, (-0.1, 0.55, 0.75), link)
        person.suck(enable=True)
        person.say("snap")
        yield lambda: gripper.part is not None
        yield went(person, (-0.1, 0.55, 0.75), link)
        yield went(person, (0.5, 0.1, 0.75), link)
        yield went(person, (-0.05, -0.52, 0.75), link)
        yield went(person, (-0.05, -0.52, 0.5), link)
        person.suck(enable=False)
        yield person.after(0.5)
        person.cell.bus.call("/ariac/tray1", AGVControlRequest(kit_type="order_0_kit_0"), node="/person")

    _, person, result = work(ur5_cell(), kits, 60.0)
    assert person.is_done
    assert result.score.total >= 1.0


def test_arm_of_a_robot_in_the_cell_is_worked() -> None:
    def raises(person: Person) -> Iterator[Callable[[], bool]]:
        person.say("arm tandem/left")
        before = tool(person, "tandem/left_tip").position
        for _ in range(10):
            person.publish(VELOCITY, velocity_request((0.0, 0.0, 0.05)))
            yield person.after(0.1)
        yield person.after(0.5)
        after = tool(person, "tandem/left_tip").position
        assert after[2] - before[2] == pytest.approx(0.05, abs=0.02)
        assert after[:2] == pytest.approx(before[:2], abs=0.01)

    _, person, _ = work(tandem_cell(), raises, 3.0)
    assert person.is_done


def test_fingers_get_over_a_part() -> None:
    def snaps(person: Person) -> Iterator[Callable[[], bool]]:
        yield went(person, (0.0, 0.6, 0.75), "arm/tool0")
        person.say("snap")
        later = person.after(0.5)
        yield lambda: later() and person.is_idle()
        assert person.state["note"] in ("", "snap: bin1|cube_1", "snap: bin1|cube_2"), person.state["note"]

    _, person, _ = work(finger_cell(), snaps, 10.0)
    assert person.is_done


def test_agent_of_a_cell_without_arms_gives_up_with_the_reason() -> None:
    result = run_cell(Cell(replace(ARM_ONLY, has_arm=False)), OperatorAgent(), RunOptions(until=1.0))
    assert result.outcome is Outcome.CRASHED
    assert "the cell has no arm and no robot that a person could work" in result.error


def test_report_is_json_with_the_joints_of_each_arm() -> None:
    reports: list[str] = []
    cell = Cell(ARM_ONLY)
    cell.bus.subscribe(REPORT, lambda message: reports.append(message.data))
    run_cell(cell, OperatorAgent(), RunOptions(until=2.5))
    assert 2 <= len(reports) <= 26
    state = json.loads(reports[0])
    assert state["arms"]["arm"]["mode"] == "idle"
    assert len(state["arms"]["arm"]["joints"]) == len(Client.in_process(Cell(ARM_ONLY)).joints)
