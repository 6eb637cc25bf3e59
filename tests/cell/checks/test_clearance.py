"""Places that arms reach without touching anything."""

from dataclasses import replace

import numpy as np

from cellwright.cell.checks.clearance import PlaceReach, State, place_reaches
from cellwright.config.layout.surroundings import Block, Structure
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose
from tests.cell.arm_cells import PEDESTAL, TWO_UR5, ur5_cell
from tests.cell.checks.odd import SMALL, trial_with

BELT = PEDESTAL.replace(
    "  trays:", "  belts: {{belt: {{from: [0.55, 2.0], to: [0.55, -1.5], width: 0.4, surface: 0.45}}}}\n  trays:"
)


def measured(trial: Trial) -> dict[str, PlaceReach]:
    return {each.surface.name: each for each in place_reaches(trial)}


def test_bin_and_tray_beside_a_pedestal_are_clear_and_the_belt_in_part() -> None:
    found = measured(ur5_cell(BELT))
    assert {name: (each.arm, round(each.clear, 2)) for name, each in found.items()} == {
        "bin1": ("arm", 1.0),
        "belt": ("arm", 0.41),
        "tray1": ("arm", 1.0),
    }
    worst = {name: each.worst for name, each in found.items() if each.worst is not None}
    assert worst.keys() == found.keys()
    assert all(each.singular > 0.02 and each.limit > 1.0 for each in worst.values())
    assert worst["belt"].singular < worst["bin1"].singular


def test_roof_over_a_bin_blocks_it() -> None:
    trial = ur5_cell()
    roof = Structure("roof", Pose((-0.1, 0.55, 0.0)), (Block(Pose((0.0, 0.0, 0.52)), (0.2, 0.2, 0.02)),))
    layout = replace(trial.layout, structure=(*trial.layout.structure, roof))
    free, roofed = measured(trial), measured(replace(trial, layout=layout))
    assert (free["bin1"].reached, free["bin1"].clear) == (1.0, 1.0)
    assert roofed["bin1"].reached == 1.0
    assert roofed["bin1"].clear < 0.9
    rows, columns = roofed["bin1"].states.shape
    assert roofed["bin1"].states[rows // 2, columns // 2] == State.BLOCKED
    assert (roofed["tray1"].states == free["tray1"].states).all()


def test_place_out_of_reach_has_no_margins() -> None:
    far = replace(SMALL.bins[0], name="far", pose=Pose((-5.0, 0.0, 0.0)), link=Pose((-5.0, 0.0, 0.0)))
    found = measured(trial_with(replace(SMALL, bins=(far,), trays=())))["far"]
    assert (found.reached, found.clear, found.worst) == (0.0, 0.0, None)
    assert (found.states == State.OUT).all()


def test_parts_do_not_count() -> None:
    trial = ur5_cell()
    full, empty = measured(trial), measured(replace(trial, bin_parts=()))
    assert trial.bin_parts
    assert all(np.array_equal(full[name].states, empty[name].states) for name in full)


def test_deep_bin_keeps_the_wrist_from_its_walls() -> None:
    trial = ur5_cell()
    deep = replace(trial.layout.bins[0], walls=0.2)
    found = measured(replace(trial, layout=replace(trial.layout, bins=(deep,))))["bin1"]
    assert found.reached == 1.0
    assert found.states[0, 0] == State.BLOCKED
    assert found.clear < 0.9


def test_measuring_twice_gives_the_same() -> None:
    one, other = measured(ur5_cell(BELT)), measured(ur5_cell(BELT))
    assert all(np.array_equal(one[name].states, other[name].states) for name in one)
    assert [each.worst for each in one.values()] == [each.worst for each in other.values()]


def test_parts_of_the_demo_tray_are_left_out() -> None:
    trial = trial_with(replace(SMALL, bins=()))
    full = replace(trial, options=replace(trial.options, fill_demo_tray=True))
    assert np.array_equal(measured(full)["table"].states, measured(trial)["table"].states)


def test_each_arm_has_its_own_reach_and_minds_the_other() -> None:
    trial = ur5_cell(TWO_UR5)
    found = {each.arm: each for each in place_reaches(trial)}
    assert [*found] == ["arm1", "arm2"]
    assert all(each.reached == 1.0 for each in found.values())
    # the other arm is at home, with its cup over the bin
    alone = measured(replace(trial, layout=replace(trial.layout, arms=trial.layout.arms[:1])))["bin1"]
    assert alone.clear > found["arm1"].clear
