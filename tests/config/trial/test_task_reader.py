"""Reader of the section `task`: what it makes of a file, and what it refuses, with the place."""

import math

import pytest

from cellwright.config.parsing.overrides import Override
from cellwright.config.trial.catalogue import bundled_tasks, find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.task import Discarded, Held, KitBuilt, LinkAt, OnTray, Scored, Task, TaskStart, Turned
from cellwright.util.errors import DescriptionError
from tests.cell.arm_cells import TWO_ON_A_RAIL
from tests.cell.robot_cells import AT_BIN
from tests.cell.tasks.cells import BASE, trial


def task(success: str, more: str = "") -> Task:
    found = trial(success, more).task
    assert found is not None
    return found


def refusal(success: str = "{kit: full}", more: str = "", base: str = BASE) -> str:
    with pytest.raises(DescriptionError) as raised:
        load_trial(text=f"{base}task:\n  sentence: Do it.\n  success: {success}\n{more}")
    return "\n".join(map(str, raised.value.problems))


def test_short_task_has_defaults() -> None:
    assert task("{kit: full}") == Task("Do it.", (KitBuilt(),), TaskStart(), 0.0, "sparse", starts_competition=True)


def test_each_condition_is_read() -> None:
    found = task(
        "{held: {part: gear_part, lifted: 0.1, by: arm}, kit: 2, score: full, discarded: {tray: tray1},"
        " turned: {part: pulley_part, tolerance: 0.3},"
        " on_tray: {part: disk_part, tray: tray2, at: [0.1, -0.1], yaw: pi/2, tolerance: 0.01, turn_tolerance: 0.2}}"
    )
    assert found.success == (
        Held("gear_part", 0.1, "arm"),
        OnTray("disk_part", "tray2", (0.1, -0.1), math.pi / 2, 0.01, 0.2),
        KitBuilt(2.0),
        Scored(),
        Discarded("tray1"),
        Turned("pulley_part", 0.3),
    )


def test_list_has_conditions_of_one_kind() -> None:
    links = (
        "{link_at: {robot: tandem, link: right_tip, at: [1, 0, 1]}}",
        "{link_at: {robot: tandem, link: torso, at: [0, 0, 1]}}",
    )
    found = load_trial(text=f"{AT_BIN}task: {{sentence: Reach., success: [{', '.join(links)}]}}").trial.task
    assert found is not None
    assert found.success == (LinkAt("tandem", "right_tip", (1.0, 0.0, 1.0)), LinkAt("tandem", "torso", (0.0, 0.0, 1.0)))


def test_start_and_settings_are_read() -> None:
    found = task(
        "{kit: full}",
        "  start: {joints: {elbow_joint: pi/2}, jitter: 0.1, holding: gear_part}\n"
        "  hold_for: 1.5\n  reward: shaped\n  starts_competition: false\n",
    )
    start = TaskStart({"elbow_joint": math.pi / 2}, 0.1, "gear_part")
    assert found == Task("Do it.", (KitBuilt(),), start, 1.5, "shaped", starts_competition=False)


def test_value_on_the_command_line_replaces_that_of_the_file() -> None:
    files = [find_trial("pick_from_bin")]
    found = load_trial(files, overrides=[Override.read("task.success.held.lifted=0.2")]).trial.task
    assert found is not None
    assert found.success == (Held("gear_part", 0.2),)


def test_moved_cell_has_its_points_elsewhere() -> None:
    text = AT_BIN.replace("cell:", "cell:\n  frame: {at: [1, 2], turn: pi/2}", 1)
    success = "{link_at: {robot: tandem, link: right_tip, at: [1, 0, 0.5]}}"
    found = load_trial(text=f"{text}task: {{sentence: Reach., success: {success}}}").trial.task
    assert found is not None
    assert isinstance(found.success[0], LinkAt)
    assert found.success[0].at == pytest.approx((1.0, 3.0, 0.5))


@pytest.mark.parametrize("name", bundled_tasks())
def test_bundled_task_has_no_warning(name: str) -> None:
    loaded = load_trial([find_trial(name)])
    assert loaded.warnings == ()
    assert loaded.trial.task is not None
    assert loaded.trial.time_limit is not None


@pytest.mark.parametrize(
    ("success", "message"),
    [
        ("{hold: {part: gear_part}}", "task.success.hold: unknown condition; did you mean held"),
        ("{}", "task.success: must have a condition (known: held, on_tray,"),
        ("[]", "task.success: must have 1 to 20 mappings of conditions (got 0)"),
        ("lift", "task.success: must be a mapping (got the text 'lift')"),
        ("{held: {part: gear_prt}}", "held.part: the cell has no part of the type 'gear_prt'; did you mean gear_part"),
        ("{held: {}}", "the required entry 'part' is missing"),
        ("{held: {part: gear_part, by: amr}}", "held.by: the cell has no arm or hand 'amr'; did you mean arm"),
        ("{held: {part: gear_part, lifted: -1}}", "held.lifted: must be from 0 to 10 m (got -1)"),
        (
            "{on_tray: {part: gear_part, tray: tray3}}",
            "on_tray.tray: the cell has no AGV or tray 'tray3'; did you mean",
        ),
        ("{kit: 0}", "task.success.kit: must be full or points above 0 (got the number 0)"),
        ("{kit: all}", "task.success.kit: must be full or points above 0 (got the text 'all')"),
        ("{discarded: {tray: tray9}}", "the cell has no AGV or tray 'tray9'"),
        ("{turned: {part: t_brace_part}}", "the cell has no part of the type 't_brace_part'"),
        ("{link_at: {robot: arm, link: tool, at: [0, 0, 1]}}", "the cell has no robot 'arm' (known: none)"),
    ],
)
def test_wrong_condition_is_refused(success: str, message: str) -> None:
    assert message in refusal(success)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("  start: {joints: {elbow: 1}}", "start.joints.elbow: the cell has no arm joint 'elbow'; did you mean"),
        ("  start: {joints: {elbow_joint: 7}}", "start.joints.elbow_joint: must be within the joint's limits of"),
        ("  start: {joints: {elbow_joint: one}}", "start.joints.elbow_joint:"),
        ("  start: {jitter: 2}", "start.jitter: must be from 0 to 1 rad or m (got 2)"),
        ("  start: {holding: disk_part}", "start.holding: the cell has no part of the type in a bin 'disk_part'"),
        ("  hold_for: -1", "task.hold_for: must be from 0 to 3600 s (got -1)"),
        ("  reward: dense", "task.reward: must be sparse or shaped (got the text 'dense')"),
        ("  starts: true", "task.starts: unknown entry; did you mean start"),
    ],
)
def test_wrong_entry_is_refused(more: str, message: str) -> None:
    assert message in refusal(more=more)


def test_errors_of_names_come_together_with_their_lines() -> None:
    found = refusal("[{held: {part: disc_part}}, {on_tray: {part: gear_part, tray: tray_1}}]")
    assert [line.split(":")[1] for line in found.splitlines()] == ["18", "18"]


def test_conditions_on_kits_need_an_order() -> None:
    base = BASE.replace("orders:", "#orders:")
    assert "task.success.score: the trial has no order; add the section orders" in refusal("{score: 1}", base=base)


def test_faulty_condition_needs_a_faulty_part() -> None:
    base = BASE.replace("faulty_parts:", "#faulty_parts:")
    assert "the trial has no faulty part" in refusal("{discarded: {tray: tray1}}", base=base)


def test_start_of_an_arm_needs_one() -> None:
    base = AT_BIN
    assert "start.joints: the cell has no arm; leave it out" in refusal(
        "{link_at: {robot: tandem, link: right_tip, at: [0, 0, 1]}}", "  start: {joints: {a: 0.1}}", base
    )
    assert "nothing in the cell can hold a part" in refusal("{held: {part: gear_part}}", base=base)
    assert "link_at.link: the cell has no link 'right_tp'; did you mean right_tip" in refusal(
        "{link_at: {robot: tandem, link: right_tp, at: [0, 0, 1]}}", base=base
    )


def test_held_part_needs_one_arm_with_a_cup() -> None:
    two = TWO_ON_A_RAIL + "\ntask:\n  sentence: Do it.\n  success: {kit: full}\n  start: {holding: gear_part}\n"
    with pytest.raises(DescriptionError, match=r"start\.holding: needs a cell with one arm, and a suction cup on it"):
        load_trial(text=two)
