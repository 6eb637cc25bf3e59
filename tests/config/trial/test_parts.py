"""Parts of a trial: bins and grids, extra parts, belt parts, drop regions and faulty parts."""

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.trial.parts import MAX_PARTS
from tests.config.trial.texts import GRID, INSERT, error, load, trial, warning


def test_part_numbers_run_per_type_as_written() -> None:
    text = f"""
options: {{insert_models_over_bins: true, model_type_aliases: {{cog: gear_part}}}}
models_over_bins:
  bin5: {{models: {{gear_part: {GRID}}}}}
  bin6: {{models: {{cog: {GRID}}}}}
  bin7: {{models: {{gear_part: {GRID}}}}}
"""
    names = sorted(part.name for part in trial(text).bin_parts)
    assert names == [
        *(f"bin5|gear_part_{i}" for i in (1, 2, 3, 4)),
        *(f"bin6|gear_part_{i}" for i in (1, 2, 3, 4)),
        *(f"bin7|gear_part_{i}" for i in (5, 6, 7, 8)),
    ]


def test_bins_are_numbered_in_python_2_dictionary_order() -> None:
    text = INSERT + f"models_over_bins: {{bin6: &b {{models: {{gear_part: {GRID}}}}}, bin5: *b}}"
    assert trial(text).bin_parts[0].name == "bin5|gear_part_1"


def test_alias_beside_its_type_in_one_bin_replaces_parts() -> None:
    text = f"""
options: {{insert_models_over_bins: true, model_type_aliases: {{cog: gear_part}}}}
models_over_bins: {{bin5: {{models: {{gear_part: {GRID}, cog: {GRID}}}}}}}
"""
    assert len(trial(text).bin_parts) == 4
    assert "exists twice, since aliases and types are numbered apart; only the later one is kept" in warning(text)


def test_grid_steps_between_whole_numbers_are_whole() -> None:
    grid = "{xyz_start: [0, 0, 0], xyz_end: [3, 3.0, 9], rpy: [0, 0, 0], num_models_x: 3, num_models_y: 3}"
    parts = trial(
        INSERT + f"models_over_bins: {{shelf: {{xyz: [10, 20, '30'], models: {{gear_part: {grid}}}}}}}"
    ).bin_parts
    assert [part.pose.position for part in parts[:4]] == [(10, 20, 30), (10, 21.5, 30), (10, 23, 30), (11, 20, 30)]
    assert parts[0].name == "shelf|gear_part_1"


def test_grid_of_one_part_is_at_start() -> None:
    grid = "{xyz_start: [0.1, 0.2, 0], xyz_end: [0.5, 0.5], rpy: [0, 0, 0], num_models_x: 1, num_models_y: 1}"
    (part,) = trial(INSERT + f"models_over_bins: {{bin1: {{models: {{gear_part: {grid}}}}}}}").bin_parts
    assert part.pose.position == pytest.approx((-1.2, -1.43, 0.75))


@pytest.mark.parametrize("models", ["{}", ""])
def test_bins_may_be_empty(models: str) -> None:
    assert trial(INSERT + f"models_over_bins:\n  bin1:\n    models: {models}\n").bin_parts == ()


def test_extra_models_are_named_by_frame_and_type() -> None:
    text = """
options: {spawn_extra_models: true}
models_to_spawn:
  agv1::kit_tray_1::kit_tray_1::tray:
    models:
      one: {type: belt_model_type1, pose: {xyz: [0.1, 0, 0.1]}}
      two: {type: part1, pose: {rpy: [0, 0, pi]}}
"""
    one, two = sorted(trial(text).extra_parts, key=lambda part: part.name)
    assert one.name == "agv1|kit_tray_1|kit_tray_1|tray|part1_1"
    assert two.name == "agv1|kit_tray_1|kit_tray_1|tray|part1_2"
    assert {one.frame, two.frame} == {"agv1::kit_tray_1::kit_tray_1::tray"}


def test_belt_parts_are_sorted_by_time() -> None:
    text = "belt_parts: {gear_part: {'5': {pose: {}}, 1.5: {pose: {}}}, belt_model_type1: {3: {pose: {}}}}"
    assert [(part.time, part.type) for part in trial(text).belt_parts] == [
        (1.5, "gear_part"),
        (3.0, "part1"),
        (5.0, "gear_part"),
    ]


def test_drop_region_corners_are_sorted() -> None:
    text = """
drops:
  drop_regions:
    here:
      min: {xyz: [0, -2.7, 0.6]}
      max: {xyz: [0.6, -3.5, 2]}
      destination: {xyz: [0.6, 'pi', 1.0]}
      part_type_to_drop: gear_part
"""
    (region,) = trial(text).drop_regions
    assert (region.lower, region.upper) == ((0.0, -3.5, 0.6), (0.6, -2.7, 2.0))
    assert region.destination.position == (0.6, math.pi, 1.0)


def test_own_aliases_replace_default_aliases() -> None:
    text = "options: {model_type_aliases: {a: gear_part}}\nbelt_parts: {belt_model_type1: {1: {pose: {}}}}"
    assert trial(text).belt_parts == ()
    assert "unknown part type 'belt_model_type1'" in warning(text)


def test_unknown_types_and_frames_are_left_out_with_warning() -> None:
    text = f"""
options: {{insert_models_over_bins: true, spawn_extra_models: true}}
models_over_bins: {{bin1: {{models: {{gear_prat: {GRID}, gear_part: {GRID}}}}}}}
models_to_spawn:
  nowhere::link: {{models: {{a: {{type: pulley_part, pose: {{}}}}}}}}
  bin1::link: {{models: {{a: {{type: pulley_part, pose: {{}}}}}}}}
"""
    loaded = load(text)
    assert [part.type for part in loaded.trial.bin_parts] == ["gear_part"] * 4
    assert len(loaded.trial.extra_parts) == 1
    messages = " ".join(map(str, loaded.warnings))
    assert "did you mean gear_part" in messages
    assert "unknown reference frame" in messages


def test_only_missing_faulty_parts_give_warning() -> None:
    text = INSERT.replace("true", "true, belt_population_cycles: 2") + (
        f"models_over_bins: {{bin1: {{models: {{gear_part: {GRID}}}}}}}\n"
        "belt_parts: {disk_part: {1: {pose: {}}}}\n"
        "faulty_parts: [gear_part_4, disk_part_clone_1, disk_part_clone_2]"
    )
    assert "no part is called 'disk_part_clone_2'; did you mean disk_part_clone_" in warning(text)
    assert trial(text).faulty_parts == {"gear_part_4", "disk_part_clone_1", "disk_part_clone_2"}


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("num_models_x: 2", "num_models_x: -2", "must be at least 0 (got -2)"),
        ("num_models_x: 2", "num_models_x: 1000000000", f"more than {MAX_PARTS} parts"),
        ("num_models_x: 2", "num_models_x: 2.0", "must be a whole number (got the number 2.0); did you mean 2"),
        ("num_models_x: 2, ", "", "the required entry 'num_models_x' is missing; is num_models_y a misspelling of it"),
        ("[0.1, 0.1, 0.0]", "[0.1, pi/2, 0]", "xyz_start[1]: must be a plain number (got the text 'pi/2')"),
        ("[0.1, 0.1, 0.0]", "[0.1, 0.1]", "must be a list of three numbers (got a list of 2)"),
        ("[0.5, 0.5, 0.0]", "[0.5, .inf, 0.0]", "must be a finite number"),
        ("[0.5, 0.5, 0.0]", "half", "must be a list of three numbers (got the text 'half')"),
        ("pi/4", "[1]", "must be a number or an expression (got a list)"),
    ],
)
def test_invalid_grid_is_refused(old: str, new: str, expected: str) -> None:
    assert expected in error(
        INSERT + f"models_over_bins: {{bin1: {{models: {{gear_part: {GRID.replace(old, new)}}}}}}}"
    )


def test_grid_with_0_rows_has_no_parts() -> None:
    grid = GRID.replace("num_models_x: 2", "num_models_x: 1000000000").replace("num_models_y: 2", "num_models_y: 0")
    assert trial(INSERT + f"models_over_bins: {{bin1: {{models: {{gear_part: {grid}}}}}}}").bin_parts == ()


@given(st.integers(0, 6), st.integers(0, 6), st.tuples(*[st.floats(-2, 2)] * 6))
def test_grid_spans_from_start_to_end(nx: int, ny: int, corners: tuple[float, ...]) -> None:
    start, end = corners[:3], corners[3:]
    grid = {"xyz_start": [*start], "xyz_end": [*end], "rpy": [0, 0, 0], "num_models_x": nx, "num_models_y": ny}
    config = {
        "options": {"insert_models_over_bins": True},
        "models_over_bins": {"table": {"xyz": [1, 2, 3], "models": {"part2": grid}}},
    }
    parts = trial(yaml.safe_dump(config)).bin_parts
    assert [part.name for part in parts] == [f"table|part2_{i + 1}" for i in range(nx * ny)]
    if nx and ny:
        assert parts[0].pose.position == pytest.approx((1 + start[0], 2 + start[1], 3 + start[2]))
        last = (end[0] if nx > 1 else start[0], end[1] if ny > 1 else start[1])
        assert parts[-1].pose.position == pytest.approx((1 + last[0], 2 + last[1], 3 + start[2]))
