"""Parts in short: grids in bins, parts on belts, and refusals."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.footprints import PART_TYPES, footprint
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose

CELL = """cell:
  bins: {bin1: {at: [1, 0], turn: pi/2, size: [0.6, 0.4], surface: 0.7}}
  belts: {belt: {from: [0, 2], to: [0, -2], width: 0.4, surface: 0.6}}
"""


def trial(*parts: str, more: str = "") -> Trial:
    """Return a trial with these parts."""
    return load_trial(text=f"{CELL}{more}parts:\n" + "".join(f"- {each}\n" for each in parts)).trial


def test_grid_is_even_in_its_bin() -> None:
    found = trial("{type: gear_part, in: bin1, grid: [2, 1], turn: 1}").bin_parts
    assert [part.name for part in found] == ["bin1|gear_part_1", "bin1|gear_part_2"]
    # the bin is turned: its x is the world's y
    assert found[0].pose.position == pytest.approx((1.0, -0.1, 0.725))
    assert found[1].pose.position == pytest.approx((1.0, 0.1, 0.725))
    assert found[0].pose.yaw == pytest.approx(math.pi / 2 + 1.0)


@pytest.mark.parametrize(
    ("text", "xs"),
    [
        ("grid: [3, 1]", [0.15, 0.3, 0.45]),
        ("grid: [3, 1], from: [0.1, 0.2]", [0.1, 0.3, 0.5]),
        ("grid: [3, 1], step: [0.1, 0.1]", [0.2, 0.3, 0.4]),
        ("grid: [3, 1], from: [0.1, 0.2], step: [0.1, 0]", [0.1, 0.2, 0.3]),
        ("from: [0.1, 0.2]", [0.1]),
        ("step: [0.1, 0.1]", [0.3]),
    ],
)
def test_what_is_left_out_centres_the_grid(text: str, xs: list[float]) -> None:
    found = trial(f"{{type: gear_part, in: bin1, {text}}}").bin_parts
    assert [part.pose.position[1] + 0.3 for part in found] == pytest.approx(xs)


def test_numbers_go_on_after_those_of_the_2017_format() -> None:
    grid = "{xyz_start: [0.1, 0.1, 0], xyz_end: [0.1, 0.1, 0], rpy: [0, 0, 0], num_models_x: 1, num_models_y: 1}"
    more = (
        "options: {insert_models_over_bins: true}\n"
        f"models_over_bins: {{place: {{xyz: [3, 3, 1], models: {{gear_part: {grid}}}}}}}\n"
    )
    found = trial("{type: gear_part, in: bin1}", more=more).bin_parts
    assert [part.name for part in found] == ["place|gear_part_1", "bin1|gear_part_2"]


def test_parts_of_2017_cells_need_no_cell() -> None:
    found = load_trial(text="parts: [{type: gear_part, in: bin7, grid: [3, 3]}]").trial
    assert len(found.bin_parts) == 9
    assert found.material_locations["gear_part"] == ("bin7",)


def test_belt_brings_parts_until_the_time_limit() -> None:
    found = trial("{type: gear_part, on: belt, every: 10, after: 5, across: 0.1, turn: pi/2}", more="time_limit: 60\n")
    assert [part.time for part in found.belt_parts] == [5.0, 15.0, 25.0, 35.0, 45.0, 55.0]
    pose = found.layout.belts[0].spawn @ found.belt_parts[0].pose
    assert pose.position == pytest.approx((0.1, 1.7, 0.606))
    assert found.belt_parts[0].belt == "belt"


def test_parts_of_several_entries_come_in_the_order_of_their_times() -> None:
    found = trial(
        "{type: gear_part, on: belt, every: 10, count: 2}", "{type: disk_part, on: belt, every: 10, after: 5, count: 2}"
    ).belt_parts
    assert [(part.time, part.type) for part in found] == [
        (0.0, "gear_part"),
        (5.0, "disk_part"),
        (10.0, "gear_part"),
        (15.0, "disk_part"),
    ]


@given(
    st.sampled_from(sorted(PART_TYPES)), st.integers(1, 4), st.integers(1, 4), st.floats(-3.0, 3.0), st.floats(0.0, 0.6)
)
def test_accepted_grid_lies_in_its_bin_without_overlap(kind: str, nx: int, ny: int, turn: float, start: float) -> None:
    try:
        found = trial(f"{{type: {kind}, in: bin1, grid: [{nx}, {ny}], turn: {turn:.3f}, from: [{start:.3f}, 0.1]}}")
    except DescriptionError:
        return
    covered = [footprint(part.type, part.pose) for part in found.bin_parts]
    assert all(each.margin(found.layout.bin("bin1").pose, (0.6, 0.4)) > -1e-5 for each in covered)
    assert all(a.gap(b, 0.1) > -1e-5 for n, a in enumerate(covered) for b in covered[:n])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{type: gear_part}", "write in: BIN or on: BELT, and one of them"),
        ("{type: gear_part, in: bin1, on: belt}", "write in: BIN or on: BELT, and one of them"),
        ("{type: gear_part, in: bin2}", "parts[0].in: the cell has no bin 'bin2'; did you mean bin1"),
        ("{type: gear_part, on: belts, every: 1}", "parts[0].on: the cell has no belt 'belts'; did you mean belt"),
        ("{type: gear_prat, in: bin1}", "parts[0].type: unknown part type 'gear_prat'; did you mean gear_part"),
        ("{type: gear_part, in: bin1, gird: [1, 1]}", "parts[0].gird: unknown entry; did you mean grid"),
        ("{type: gear_part, in: bin1, grid: [0, 1]}", "must be from 1 to 100 parts (got 0)"),
        ("{type: gear_part, in: bin1, grid: 3}", "must be [columns, rows] (got the number 3)"),
        ("{type: gear_part, in: bin1, grid: [9, 9]}", "too many parts for bin1: two overlap by"),
        ("{type: gear_part, in: bin1, from: [0.02, 0.2]}", "would reach over the edge of bin1 by 19 mm"),
        ("{type: gear_part, on: belt, every: 1, across: 0.18}", "would reach over the edge of belt by 19 mm"),
        ("{type: gear_part, on: belt}", "the required entry 'every' is missing"),
        ("{type: gear_part, on: belt, every: 0}", "parts[0].every: must be from 0.1 to 100000 s (got 0)"),
        ("5", "parts[0]: must be a mapping (got the number 5)"),
    ],
)
def test_mistake_is_refused_with_its_line(text: str, reason: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        trial(text)
    assert any(str(each).startswith("<text>:5: ") and reason in str(each) for each in caught.value.problems)


def test_parts_of_two_entries_must_not_overlap() -> None:
    with pytest.raises(DescriptionError, match="too many parts for bin1"):
        trial("{type: gear_part, in: bin1}", "{type: disk_part, in: bin1}")


def test_own_part_type_must_stay_in_its_bin() -> None:
    more = "cellwright: {parts: {cube: {mass: 0.2, shapes: [{box: [0.04, 0.04, 0.04]}]}}}\n"
    assert len(trial("{type: cube, in: bin1, grid: [2, 2]}", more=more).bin_parts) == 4
    with pytest.raises(DescriptionError, match="outside bin1"):
        trial("{type: cube, in: bin1, from: [0.7, 0.1]}", more=more)


def test_parts_of_a_refused_bin_are_not_reported_twice() -> None:
    with pytest.raises(DescriptionError) as caught:
        load_trial(text="{cell: {bins: {a: {at: 1}}}, parts: [{type: gear_part, in: a}]}")
    assert len(caught.value.problems) == 1


def test_parts_of_2023_are_refused_with_their_year() -> None:
    with pytest.raises(DescriptionError, match="2023"):
        load_trial(text="parts: {bins: {}}")


def test_pose_is_flat() -> None:
    found = trial("{type: gear_part, in: bin1}").bin_parts[0].pose
    assert found.rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, 1.0))
    assert isinstance(found, Pose)
