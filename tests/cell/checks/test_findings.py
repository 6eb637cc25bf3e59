"""Findings about cells of one's own."""

from dataclasses import replace
from pathlib import Path

import pytest

import cellwright
from cellwright.cell.checks.findings import cell_warnings, findings
from cellwright.config.layout.arms import Arm, Mount
from cellwright.config.trial.catalogue import bundled
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.pose import Pose
from cellwright.viewer.map_reach import fields
from tests.cell.arm_cells import ARMS, PEDESTAL
from tests.cell.checks.odd import SMALL, bin_at, camera_over, post_at, trial_with
from tests.support.places import LAYOUT


@pytest.mark.parametrize("name", bundled())
@pytest.mark.filterwarnings("ignore")
def test_bundled_trial_has_no_findings(name: str) -> None:
    assert findings(cellwright.load_trial(name)) == ()


def test_small_cell_has_no_findings() -> None:
    assert findings(trial_with(SMALL, camera_over("logical_camera_left", -0.4, 0.5, 1.3))) == ()


def test_findings_name_the_description_and_the_reason() -> None:
    layout = replace(
        LAYOUT,
        bins=(bin_at("half", -1.0, 0.0), bin_at("far", -3.0, 0.0), bin_at("near", -0.9, 0.3)),
        structure=(post_at("post", -1.5, 3.3),),
    )
    found = {each.key: each.message for each in findings(trial_with(layout, camera_over("eye", -1.0, 0.0, 3.0)))}
    assert found.keys() == {
        *("cell.bins.half", "cell.bins.far", "cell.bins.near", "cell.carriers.agv1.path", "sensors.eye")
    }
    assert found["cell.bins.half"] == "50% is out of reach of the arm, tool down; move it nearer"
    assert found["cell.bins.far"] == "out of reach of the arm, tool down; move it nearer"
    assert found["cell.bins.near"] == "overlaps half by 0.30 m; move one of them"
    assert found["cell.carriers.agv1.path"].startswith("runs into post at [-1.")


OWN = """\
cell:
  arms: {arm: {mount: {kind: rail, at: [0.3, 0]}}}
  bins:
    near: {at: [-0.4, 0.5]}
    far: {at: [-3, 0]}
  carriers:
    agv1: {at: [0.3, 3.3], turn: pi}
  structure:
    post: {at: [0.3, 6, 0], boxes: [{at: [0, 0, 1], size: [0.1, 0.1, 2]}]}
sensors:
  logical_camera_1: {type: logical_camera, pose: {xyz: [-0.4, 0.5, 2.5], rpy: [0, pi/2, 0]}}
"""


def test_warnings_stand_at_the_lines_of_the_file() -> None:
    loaded = load_trial(text=OWN)
    assert loaded.warnings == ()
    found = [str(each).partition(": ") for each in cell_warnings(loaded.trial, loaded.places)]
    assert [(place, text.partition(":")[0]) for place, _, text in found] == [
        ("<text>:5", "cell.bins.far"),
        ("<text>:7", "cell.carriers.agv1.path"),
        ("<text>:11", "sensors.logical_camera_1"),
    ]


def test_trial_of_the_2017_cell_has_no_warnings_at_all() -> None:
    loaded = load_trial(text="sensors: {logical_camera_1: {type: logical_camera, pose: {xyz: [9, 9, 9]}}}")
    assert cell_warnings(loaded.trial, loaded.places) == ()


def test_moved_cell_of_2017_is_accepted_as_it_is() -> None:
    assert findings(trial_with(LAYOUT.moved(Pose((2.0, 1.0, 0.0))))) == ()


def test_bin_of_2017_counts_when_the_rail_is_elsewhere() -> None:
    found = findings(trial_with(replace(LAYOUT, arms=(Arm("arm", Mount("rail", Pose((3.0, 0.0, 0.9)))),))))
    assert {"cell.bins.bin1", "cell.carriers.agv1"} <= {each.key for each in found}


def test_cell_without_an_arm_has_no_reach() -> None:
    layout = replace(SMALL, bins=(bin_at("far", -3.0, 0.0),))
    assert findings(trial_with(layout, has_arm=False)) == ()


def test_arm_whose_first_axis_is_tilted_takes_too_long_to_be_judged(tmp_path: Path) -> None:
    urdf = tmp_path / "tilted.urdf"
    text = (ARMS / "ur5.urdf").read_text()
    urdf.write_text(text.replace('xyz="0 0 0.089159" rpy="0 0 0"', 'xyz="0 0 0.089159" rpy="0 0.3 0"'))
    cell = PEDESTAL.replace("at: [-0.1, 0.55], size", "at: [-0.1, 9.0], size")
    upright, tilted = (load_trial(text=cell.format(model=file)).trial for file in (ARMS / "ur5.urdf", urdf))
    assert [each.key for each in findings(upright)] == ["cell.bins.bin1"]
    assert findings(tilted) == ()
    assert {mark.meaning for mark, _, _ in fields(upright, ())} == {"out of reach, tool down"}
    assert not [*fields(tilted, ())]
