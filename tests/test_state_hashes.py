"""Digests that tell a moved hash from a moved part."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.config.layout.layout import Layout
from cellwright.config.trial.catalogue import bundled, bundled_tasks, find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.pose import Pose
from tests.state_hashes import kept, measured, motion, verdict
from tests.support.cells import WHOLE, run
from tests.support.places import LAYOUT

RESULT: dict[str, object] = {"outcome": "done", "points": 8.0, "state_hash": "a", "motion": "b"}


def moving(layout: Layout = LAYOUT) -> Cell:
    cell = Cell(replace(WHOLE, layout=layout), competition=False)
    cell.conveyors["belt"].set_power(100.0)
    cell.agvs[1].send("kit")
    run(cell, 2.0)
    return cell


def test_each_bundled_trial_has_hash_and_digest_of_motion() -> None:
    assert set(kept()) == {*bundled(), *bundled_tasks()}
    for figures in kept().values():
        assert {name: type(value) for name, value in figures.items()} == {
            name: type(value) for name, value in RESULT.items()
        }


@pytest.mark.slow
@pytest.mark.parametrize("trial", ["lesson", "pick_from_bin", "hand_over"])
def test_trial_has_kept_hash_and_motion(trial: str) -> None:
    assert measured(trial) == kept()[trial]


def test_cell_that_is_based_on_that_of_2017_alone_is_that_cell_to_the_bit(tmp_path: Path) -> None:
    own = tmp_path / "cell.yaml"
    own.write_text("cell: {based_on: gear2017}\n")
    lesson = find_trial("lesson")
    cells = [Cell(load_trial(files).trial, competition=False) for files in ([lesson], [lesson, own])]
    assert cells[0].trial == cells[1].trial
    for cell in cells:
        cell.competition.start()
        run(cell, 2.0)
    assert cells[0].state_hash() == cells[1].state_hash()


def test_order_of_bins_and_agvs_moves_hash_but_no_part() -> None:
    layout = replace(LAYOUT, bins=LAYOUT.bins[::-1], carriers=LAYOUT.carriers[::-1])
    one, other = moving(), moving(layout)
    assert one.state_hash() != other.state_hash()
    assert motion(one) == motion(other)


def test_motion_is_same_in_same_run_and_moves_with_a_part_or_the_arm() -> None:
    found = {motion(moving()), motion(moving())}
    assert len(found) == 1
    for name in ("gear", "elbow_joint"):
        cell = moving()
        joint = cell.parts.all[0].name if name == "gear" else name
        cell.simulation.data.joint(joint).qpos[0] += 1e-12
        found.add(motion(cell))
    assert len(found) == 3


def test_motion_leaves_sign_of_zero_out() -> None:
    cell = Cell(replace(WHOLE, bin_parts=(), extra_parts=()))
    before = motion(cell)
    cell.simulation.data.joint("agv1_x").qvel[0] = -0.0
    assert motion(cell) == before


def test_layout_moved_by_a_picometre_moves_parts() -> None:
    assert motion(moving()) == motion(moving(LAYOUT.moved(Pose())))
    assert motion(moving()) != motion(moving(LAYOUT.moved(Pose((1e-12, 0.0, 0.0)))))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({}, "same"),
        ({"state_hash": "c"}, "same motion, DIFFERENT state_hash"),
        ({"points": 7.0, "outcome": "time"}, "same motion, DIFFERENT outcome and points"),
        ({"motion": "c", "state_hash": "c"}, "DIFFERENT"),
    ],
)
def test_verdict_says_whether_motion_is_same(changed: dict[str, object], said: str) -> None:
    assert verdict({**RESULT, **changed}, RESULT) == said


def test_trial_that_file_lacks_differs() -> None:
    assert verdict(RESULT, None) == "DIFFERENT"
