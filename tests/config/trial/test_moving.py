"""Trial whose whole cell stands elsewhere, or turned."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright import load_trial
from cellwright.cell.variation import vary
from cellwright.config.models.model import Furniture, UserModel
from cellwright.config.sensors import PictureCameraConfig, SensorConfig
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.config.trial.moving import moved
from cellwright.config.trial.trial import DropRegion, Part, Trial
from cellwright.util.pose import Pose

REGION = DropRegion("over_bin", "gear_part", (-0.6, 0.0, 0.8), (0.0, 0.5, 1.0), Pose((0.3, 3.0, 0.8)))
TRIAL = Trial(
    "own",
    sensors=(
        SensorConfig("beam", "break_beam", Pose((1.6, 2.0, 0.95))),
        PictureCameraConfig("wrist", "rgb_camera", Pose((0.1, 0.0, 0.0)), frame="wrist_3_link"),
        PictureCameraConfig("above", "rgb_camera", Pose((0.0, 0.0, 2.0))),
    ),
    bin_parts=(Part("bin7|gear_part_1", "gear_part", Pose((-0.3, 0.2, 0.8))),),
    extra_parts=(
        Part("tray|gear_part_1", "gear_part", Pose((0.1, 0.0, 0.0)), "agv1::kit_tray_1::kit_tray_1::tray"),
        Part("world|gear_part_2", "gear_part", Pose((1.0, 1.0, 1.0)), "world"),
    ),
    drop_regions=(REGION,),
    furniture=(Furniture("post", UserModel(), Pose((2.0, 0.0, 0.0))),),
)
QUARTER = Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2))

metres = st.floats(-5.0, 5.0)
moves = st.builds(
    lambda x, y, yaw: Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw)), metres, metres, st.floats(-math.pi, math.pi)
)


def test_moved_by_nothing_is_same_trial() -> None:
    trial = load_trial("final08")
    assert moved(trial, Pose()) == trial
    assert moved(TRIAL, Pose()) == TRIAL


def test_what_stands_on_a_link_moves_with_it() -> None:
    turned = moved(TRIAL, QUARTER)
    assert turned.sensors[1] == TRIAL.sensors[1]
    assert turned.extra_parts[0] == TRIAL.extra_parts[0]


def test_sensors_parts_and_furniture_keep_their_places_to_the_layout() -> None:
    turned = moved(TRIAL, QUARTER)
    assert turned.layout == TRIAL.layout.moved(QUARTER)
    for before, after in (
        (TRIAL.sensors[0].pose, turned.sensors[0].pose),
        (TRIAL.sensors[2].pose, turned.sensors[2].pose),
        (TRIAL.bin_parts[0].pose, turned.bin_parts[0].pose),
        (TRIAL.extra_parts[1].pose, turned.extra_parts[1].pose),
        (TRIAL.furniture[0].pose, turned.furniture[0].pose),
        (REGION.destination, turned.drop_regions[0].destination),
    ):
        assert after == QUARTER @ before


@given(moves, st.tuples(metres, metres, st.floats(0.0, 2.0)))
def test_drop_region_moves_whole(by: Pose, point: tuple[float, float, float]) -> None:
    region = moved(replace(TRIAL, sensors=()), by).drop_regions[0]
    assert region.centre == pytest.approx(by.transform(REGION.centre))
    # a point on the very edge may be rounded to either side of it
    (left, front, low), (right, back, high), slack = REGION.lower, REGION.upper, 1e-9
    inner = replace(REGION, lower=(left + slack, front + slack, low), upper=(right - slack, back - slack, high))
    outer = replace(REGION, lower=(left - slack, front - slack, low), upper=(right + slack, back + slack, high))
    if inner.covers(point) == outer.covers(point):
        assert region.covers(by.transform(point)) == REGION.covers(point)


def test_frame_of_section_cell_moves_whole_trial() -> None:
    written = "".join(find_trial(name).read_text() for name in ("final08", "kitter_sensors"))
    cell = "cell: {based_on: gear2017, frame: {at: [2, 1], turn: pi/2}}"
    found = load_text(text=f"{written}\n{cell}\n").trial
    assert found == moved(load_text(text=written).trial, QUARTER)
    assert found.drop_regions[0].frame == QUARTER


def test_trial_varies_alike_wherever_it_stands() -> None:
    trial = load_trial("final08")
    here, there = vary(trial, 5), vary(moved(trial, QUARTER), 5)
    assert here != trial
    for one, other in zip(moved(here, QUARTER).bin_parts, there.bin_parts, strict=True):
        assert other.pose.position == pytest.approx(one.pose.position)
        assert other.pose.quaternion == pytest.approx(one.pose.quaternion)


def test_grid_of_parts_lies_along_edges_of_turned_bin() -> None:
    grid = "{xyz_start: [0.1, 0.1, 0], xyz_end: [0.3, 0.1, 0], rpy: [0, 0, 0], num_models_x: 2, num_models_y: 1}"
    bins = f"models_over_bins: {{a: {{models: {{gear_part: {grid}}}}}}}"
    options = "options: {insert_models_over_bins: true}"
    cell = "cell: {bins: {a: {at: [2, 1], turn: pi/2, size: [0.4, 0.6]}}}"
    one, other = load_text(text="\n".join((cell, options, bins))).trial.bin_parts
    # the corner of least x and y of the bin is at 2.3, 0.8
    assert one.pose.position == pytest.approx((2.2, 0.9, 0.75))
    assert other.pose.position == pytest.approx((2.2, 1.1, 0.75))
    assert one.pose.yaw == pytest.approx(math.pi / 2)
