"""The 2017 format: valid entries, warnings and errors."""

import contextlib
import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import TOP_LEVEL, Loaded, load_trial
from cellwright.config.trial.trial import Options, Trial
from cellwright.util.errors import DescriptionError, UsageError

LESSON = find_trial("lesson").read_text()

GRID = "{xyz_start: [0.1, 0.1, 0.0], xyz_end: [0.5, 0.5, 0.0], rpy: [0, 0, pi/4], num_models_x: 2, num_models_y: 2}"
INSERT = "options: {insert_models_over_bins: true}\n"
ORDER = "announcement_condition: time, announcement_condition_value: 0.0"
PART = "{type: gear_part, pose: {}}"


def load(text: str) -> Loaded:
    return load_trial(text=text)


def trial(text: str) -> Trial:
    return load(text).trial


def warnings(text: str) -> list[str]:
    return [str(problem).removeprefix("<text>:") for problem in load(text).warnings]


def errors(text: str) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        load(text)
    return [str(problem).removeprefix("<text>:") for problem in caught.value.problems]


def error(text: str) -> str:
    found = errors(text)
    assert len(found) == 1, found
    return found[0]


def warning(text: str) -> str:
    found = warnings(text)
    assert len(found) == 1, found
    return found[0]


def conditional(condition: str, value: object) -> str:
    terms = f"announcement_condition: {condition}, announcement_condition_value: {value}"
    return f"orders: {{o: {{{terms}, parts: {{a: {PART}}}}}}}"


# --- what is read -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["", "# nothing\n", "---\n", "{}", "null"])
def test_empty_configuration_is_empty_cell(text: str) -> None:
    empty = trial(text)
    assert empty == Trial("text", material_locations={"tray": ("agv1_load_point", "agv2_load_point")})
    assert empty.time_limit == 500.0
    assert not empty.has_arm


@pytest.mark.parametrize(("written", "limit"), [("-1", None), ("-0.5", None), ("0", 0.0), ("7", 7.0)])
def test_negative_time_limit_of_a_file_is_none(written: str, limit: float | None) -> None:
    loaded = load_trial(text=f"time_limit: {written}")
    assert (loaded.trial.time_limit, loaded.time_limit) == (limit, float(written))


def test_trial_refuses_a_negative_time_limit() -> None:
    with pytest.raises(UsageError, match=r"^time_limit: must not be negative \(got -1\); use None for no limit$"):
        Trial("endless", time_limit=-1.0)


def test_lesson_trial_is_read() -> None:
    loaded = load_trial([find_trial("lesson")])
    lesson = loaded.trial
    assert loaded.warnings == ()
    assert (lesson.name, lesson.has_arm, lesson.time_limit) == ("lesson", True, None)
    assert lesson.options == Options(insert_models_over_bins=True, belt_population_cycles=20)
    assert [part.name for part in lesson.bin_parts[:2]] == ["bin7|piston_rod_part_1", "bin7|piston_rod_part_2"]
    assert len(lesson.bin_parts) == 12 + 9
    first = lesson.bin_parts[0].pose
    assert first.position == pytest.approx((-0.5, 0.03, 0.75))
    assert first.yaw == pytest.approx(math.pi / 4)
    assert [(part.time, part.type) for part in lesson.belt_parts] == [(6.0, "gear_part")]
    (order,) = lesson.orders
    assert (order.order_id, order.start_time, order.wanted_parts) == ("order_0", 0.0, None)
    (kit,) = order.kits
    assert kit.kit_type == "order_0_kit_0"
    assert [item.type for item in kit.objects] == ["piston_rod_part"] * 2 + ["gear_part"] * 2
    assert kit.objects[2].pose.position == (0.73, -0.17, -0.21)
    assert [sensor.type for sensor in lesson.sensors] == [
        "break_beam",
        "proximity_sensor",
        "logical_camera",
        "logical_camera",
        "laser_profiler",
    ]
    assert lesson.sensors[4].pose.rpy != (0.0, 0.0, 0.0)
    assert lesson.material_locations == {
        "tray": ("agv1_load_point", "agv2_load_point"),
        "gear_part": ("belt", "bin8"),
        "piston_rod_part": ("bin7",),
    }


def test_trial_and_team_file_are_joined(tmp_path: Path) -> None:
    final, team = tmp_path / "final.yaml", tmp_path / "team.yaml"
    final.write_text("time_limit: 300\narm: {type: none}\n")
    team.write_text("arm: {type: ur10}\nsensors: {beam: {type: break_beam, pose: {xyz: [1, 2, 3]}}}\n")
    loaded = load_trial([final, team])
    assert loaded.trial.name == "final"
    assert loaded.trial.has_arm
    assert loaded.trial.sensors[0].pose.position == (1.0, 2.0, 3.0)
    assert [str(w) for w in loaded.warnings] == [f"{team}:1: arm: replaces the entry of {final}:2"]


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


def test_orders_have_kits_conditions_and_ids() -> None:
    text = f"""
orders:
  order_0: {{{ORDER}, kit_count: 2, parts: {{a: {PART}}}}}
  order_1: {{announcement_condition: wanted_parts, announcement_condition_value: '2', parts: {{a: {PART}}}}}
  order_2: {{announcement_condition: unwanted_parts, announcement_condition_value: 1, parts: {{a: {PART}}}}}
"""
    two, zero, one = trial(text).orders
    assert [kit.kit_type for kit in zero.kits] == ["order_0_kit_0", "order_0_kit_1"]
    assert (one.start_time, one.wanted_parts, one.unwanted_parts) == (None, 2, None)
    assert (two.order_id, two.yaml_name, two.unwanted_parts) == ("order_0", "order_2", 1)
    # Python 2 iterated over order_2 first, so its kits are called after order_2 and its id is order_0.
    assert [message.split(" ")[0] for message in warnings(text)] == ["3:", "4:", "5:"]
    assert "orders.order_2: its id is order_0" in warnings(text)[2]


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


def test_material_locations_do_not_depend_on_insertion() -> None:
    text = f"models_over_bins: {{bin3: {{models: {{gear_part: {GRID}}}}}}}"
    assert trial(text).material_locations["gear_part"] == ("bin3",)
    assert trial(text).bin_parts == ()
    assert "unless options.insert_models_over_bins is true" in warning(text)


def test_own_aliases_replace_default_aliases() -> None:
    text = "options: {model_type_aliases: {a: gear_part}}\nbelt_parts: {belt_model_type1: {1: {pose: {}}}}"
    assert trial(text).belt_parts == ()
    assert "unknown part type 'belt_model_type1'" in warning(text)


# --- warnings -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("options: {insert_agv: true}", "1: options.insert_agv: unknown option, ignored; did you mean insert_agvs"),
        ("options: {visualize_sensor_views: true}", "new in the 2018 format"),
        ("options: {insert_agvs: 'false'}", "(got the text 'false'); counts as true"),
        ("options: {insert_agvs: 0}", "(got the number 0); counts as false"),
        ("options: {insert_agvs: }", "(got an empty value); counts as false"),
        ("options: {belt_population_cycles: true}", "the boolean true counts as 1"),
        ("arm: {type: ur10, tool: x}", "arm.tool: unknown entry, ignored"),
        ("arm: {type: ur10, initial_joint_states: {elbow_joint: pi/2}}", "move it to cellwright: arm:"),
        ("sensors: {a: {type: brake_beam, pose: {}}}", "the sensor is left out; did you mean break_beam"),
        ("sensors: {a: {type: depth_camera, pose: {}}}", "'depth_camera' of the 2018 format, the sensor is left out"),
        ("sensors: {a: {type: break_beam, pose: {}, sort: 1}}", "sensors.a.sort: unknown entry, ignored"),
        (
            "sensors: {a: {type: break_beam, pose: {ryp: [0, 0, 1]}}}",
            "a.pose.ryp: unknown entry, ignored; did you mean rpy",
        ),
        ("sensors: {cam: {type: logical_camera, pose: {}}}", "its frame is published twice"),
        ("sensors: {logical_camera_x: {type: break_beam, pose: {}}}", "this sensor has no frame"),
        ("sensors: {1st: {type: break_beam, pose: {}}}", "begins with a digit"),
        ("belt_parts: {u_joint_part: {1: {pose: {}}}}", "unknown part type 'u_joint_part', left out of the cell"),
        ("belt_parts: {gear_part: {-1: {pose: {}}}}", "must not be negative (got -1)"),
        ("belt_parts: {gear_part: {1: {pose: {}, speed: 2}}}", "speed: unknown entry, ignored"),
        (f"orders: {{o: {{{ORDER}, kit_count: 0, parts: {{a: {PART}}}}}}}", "asks for no kits"),
        (f"orders: {{o: {{{ORDER}, parts: {{}}}}}}", "asks for no parts"),
        (
            f"orders: {{o: {{{ORDER}, kitcount: 2, parts: {{a: {PART}}}}}}}",
            "o.kitcount: unknown entry, ignored; did you mean kit_count",
        ),
        (conditional("Time", "x"), "the order is never announced; did you mean time"),
        (conditional("wanted_parts", -1), "wanted_parts must be at least 1 (got -1)"),
        (conditional("wanted_parts", 2.7), "(got 2.7); 2 is used"),
        ("faulty_parts: [gear_part_1]", "1: faulty_parts[0]: no part is called 'gear_part_1'"),
        (
            "faulty_parts: ab",
            "should be a list of names, such as [ab] (got the text 'ab'); each letter counts as a name",
        ),
        ("faulty_parts: [~]", "empty entry, ignored"),
        ("drops: {drop_regions: {}, x: 1}", "drops.x: unknown entry, ignored"),
        ("sensors: {a: {type: break_beam, pose: {rpy: [0, 0, 3/2]}}}", "'3/2' is 1, the integer division of Python 2"),
        ("options: {fill_demo_tray: true}", "options.fill_demo_tray: no effect without an order"),
        ("options: {}\noptions: {}", "2: options: duplicate key"),
    ],
)
def test_tolerated_entry_gives_one_warning(text: str, expected: str) -> None:
    assert expected in warning(text)


def test_order_with_unfulfillable_condition_has_none() -> None:
    for condition, value in (("soon", 1), ("wanted_parts", 0)):
        (order,) = trial(conditional(condition, value)).orders
        assert (order.start_time, order.wanted_parts, order.unwanted_parts) == (None, None, None)


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


# --- errors -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sensor: {}", "1: sensor: unknown top-level entry; did you mean sensors"),
        ("3: {}", "1: 3: unknown top-level entry (known: arm"),
        ("belt_models: {}", "unknown top-level entry; it belongs to the 2018 format or a later one"),
        ("agv_infos: {}", "belongs to the 2021 format or a later one"),
        ("[1, 2]", "a configuration must be a mapping of sections (got a list)"),
        ("hello", "a configuration must be a mapping of sections (got the text 'hello')"),
        *(
            (f"{name}:", f"1: {name}: must be a mapping (got an empty value)")
            for name in ("arm", "sensors", "options", "orders")
        ),
        *(
            (f"{name}:", f"{name}: must be a mapping (got an empty value)")
            for name in ("models_over_bins", "belt_parts", "drops")
        ),
        ("faulty_parts:", "must be a list of names (got an empty value)"),
        ("time_limit:", "must be a number (got an empty value)"),
        ("time_limit: .inf", "must be a finite number"),
        ("time_limit: .nan", "must be a finite number"),
        ("time_limit: 2*60", "must be a number (got the text '2*60')"),
        ("time_limit: no", "must be a number (got the boolean false)"),
        ("arm: {}", "the required entry 'type' is missing"),
        ("arm: {type: ur5}", "unknown arm 'ur5'"),
        ("arm: {type: UR10}", "did you mean ur10"),
        ("options: {belt_population_cycles: -1}", "must be at least 0 (got -1)"),
        ("options: {belt_population_cycles: 1.5}", "must be a whole number"),
        ("options: {model_type_aliases: }", "must be a mapping (got an empty value)"),
        ("options: {model_type_aliases: {a: [b]}}", "must be a name (got a list)"),
        ("sensors: {on: {type: break_beam, pose: {}}}", "must be a name (got the boolean true); put it in quotes"),
        ("sensors: {a-b: {type: break_beam, pose: {}}}", "use only letters, digits and _, and /"),
        ("sensors: {orders: {type: break_beam, pose: {}}}", "the cell has a topic 'orders'; choose another name"),
        (
            "sensors: {b: {type: break_beam, pose: {}}, b_change: {type: break_beam, pose: {}}}",
            "the break beam 'b' has a topic of this name",
        ),
        ("sensors: {a: {type: break_beam}}", "1: sensors.a: the required entry 'pose' is missing"),
        (
            "sensors: {a: {typ: break_beam, pose: {}}}",
            "the required entry 'type' is missing; is typ a misspelling of it",
        ),
        ("sensors: {a: {type: break_beam, pose: }}", "must be a mapping (got an empty value)"),
        ("sensors: {a: {type: break_beam, pose: {xyz: [0, 0]}}}", "must be a list of three numbers (got a list of 2)"),
        ("sensors: {a: {type: break_beam, pose: {xyz: 0 0 0}}}", "must be a list of numbers (got the text '0 0 0')"),
        ("sensors: {a: {type: break_beam, pose: {xyz: [0, 0, .nan]}}}", "xyz[2]: nan is not a finite number"),
        ("sensors: {a: {type: break_beam, pose: {xyz: [0, 0, 1e9]}}}", "coordinates must be within ±10000 m"),
        ("sensors: {a: {type: break_beam, pose: {rpy: [0, 0, 9**9**9]}}}", "is too large"),
        ("sensors: {a: {type: break_beam, pose: {rpy: [0, 0, pie]}}}", "rpy[2]: 'pie' uses 'pie', which is not in"),
        (
            "sensors: {a: {type: break_beam, pose: {rpy: [0, 0, ~]}}}",
            "must be a number or an expression (got an empty value)",
        ),
        ("arm: {type: ur10, x: {y: {xyz: [exit()]}}}", "arm.x.y.xyz[0]: 'exit()'"),
        ("belt_parts: {gear_part: }", "must be a mapping (got an empty value)"),
        ("belt_parts: {gear_part: {1: }}", "files without one are of the 2016 format"),
        ("belt_parts: {gear_part: {pose: {}}}", "must be a time [s] with the pose below it"),
        ("belt_parts: {gear_part: {soon: {pose: {}}}}", "must be a number (got the text 'soon')"),
        ("options: {belt_population_cycles: 3000}\nbelt_parts: {gear_part: {1: {pose: {}}}}", "more than 2000 parts"),
        (
            "options: {belt_population_cycles: 1000000000000}\nbelt_parts: {gear_part: {1: {pose: {}}}}",
            "more than 2000 parts",
        ),
        ("orders: [{id: A}]", "a list of orders belongs to the 2023 format"),
        ("orders: {o: {announcement_condition: time, parts: {}}}", "'announcement_condition_value' is missing"),
        (
            f"orders: {{o: {{{ORDER}, kit_count: '2', parts: {{a: {PART}}}}}}}",
            "must be a whole number (got the text '2'); did you mean 2",
        ),
        (f"orders: {{o: {{{ORDER}, kit_count: -2, parts: {{a: {PART}}}}}}}", "must be at least 0 (got -2)"),
        (f"orders: {{o: {{{ORDER}, kit_count: 1000000000, parts: {{a: {PART}}}}}}}", "asks for more than 2000 parts"),
        (f"orders: {{o: {{{ORDER}, parts: [1]}}}}", "must be a mapping (got a list)"),
        ("faulty_parts: [[a]]", "must be a name (got a list)"),
        ("drops: {}", "the required entry 'drop_regions' is missing"),
        ("models_over_bins: {bin9: {models: {}}}", "only bins have a default; did you mean bin"),
        ("models_over_bins: {bin1: {}}", "the required entry 'models' is missing"),
        ("models_over_bins: {1: {models: {}}}", "must be a name (got the number 1)"),
        (
            "options: {spawn_extra_models: true}\nmodels_to_spawn: {world: {models: }}",
            "must be a mapping (got an empty value)",
        ),
    ],
)
def test_invalid_configuration_is_refused(text: str, expected: str) -> None:
    assert expected in error(text)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("num_models_x: 2", "num_models_x: -2", "must be at least 0 (got -2)"),
        ("num_models_x: 2", "num_models_x: 1000000000", "more than 2000 parts"),
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


def test_errors_name_year_of_other_formats() -> None:
    early = "orders: {order_0: {announcement_time: 30, parts: {}}, order_1: {announcement_time: 60, parts: {}}}"
    first, second = errors(early)
    assert "orders.order_0.announcement_time: this entry belongs to the 2016 format" in first
    assert "write announcement_condition: time and announcement_condition_value: 30 instead" in first
    assert second.endswith("announcement_condition_value: 60 instead")
    assert "belt parts are listed by type and then by time [s]" in error("belt_parts: {1.0: {type: part1, pose: {}}}")
    assert "must be a number (got the text 'xyz')" in error("belt_parts: {part1: {xyz: [0, 0, 0]}}")
    later = (
        "orders: {o: {announcement_condition: time, announcement_condition_value: 0, products: {}, destinations: []}}"
    )
    assert "'products' belongs to the 2019 format; Cellwright reads the 2017 format; did you mean parts" in error(later)


def test_all_errors_are_listed_in_line_order() -> None:
    text = "time_limit: x\nsensor: {}\narm: {type: ur3}\nfaulty_parts: 3\n"
    assert [message.split(":")[0] for message in errors(text)] == ["1", "2", "3", "4"]


def test_error_with_control_characters_is_one_line() -> None:
    message = error('"a\\nb\\ud800": 1')
    assert message.startswith(r"1: a\nb\ud800: unknown top-level entry")
    message.encode()


def test_load_trial_without_source_or_with_two_is_refused() -> None:
    with pytest.raises(UsageError):
        load_trial()
    with pytest.raises(UsageError):
        load_trial([Path("a.yaml")], text="")


# --- whatever comes -----------------------------------------------------------------------------------------------


@pytest.mark.slow
@given(st.data())
@settings(max_examples=60, deadline=None)
def test_damaged_lesson_is_read_or_refused(data: st.DataObject) -> None:
    text = LESSON
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text)))
        end = at + data.draw(st.integers(0, 30))
        text = (
            text[:at]
            + data.draw(st.sampled_from(["", "x", ":", "[", "- ", "\n", "{", "&a ", "*a", "9", "~", "'"]))
            + text[end:]
        )
    with contextlib.suppress(DescriptionError):
        load(text)


odd_values = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 3),
    st.sampled_from([10**9, -(10**30), 1.5, math.inf, math.nan, "pi", "9**9**9", "x", "", "a\nb", "\ud800"]),
    st.lists(st.integers(0, 2), max_size=4),
    st.dictionaries(
        st.one_of(st.none(), st.booleans(), st.integers(0, 2), st.sampled_from(["x", "xyz"])), st.none(), max_size=2
    ),
)
BASE: dict[str, Any] = yaml.safe_load(
    LESSON
    + f"""
drops:
  drop_regions:
    a:
      min: {{xyz: [0, 0, 0]}}
      max: {{xyz: [1, 1, 1]}}
      destination: {{xyz: [0, 0, 0]}}
      part_type_to_drop: part1
faulty_parts: [piston_rod_part_1]
models_to_spawn: {{"bin8::link": {{models: {{a: {PART}}}}}}}
cellwright:
  seed: 1
  timestep: 1/500
  arm: {{servo: precise, gains: {{elbow_joint: {{p: 1, d: 1}}}}, constraints: {{goal_time: 1}}}}
"""
)


def replaced(tree: Any, data: st.DataObject) -> Any:
    """Return the tree with one of its values replaced by an odd one, or one key renamed."""
    if isinstance(tree, dict) and tree and data.draw(st.integers(0, 7)):
        key = data.draw(st.sampled_from(sorted(tree, key=str)))
        if data.draw(st.integers(0, 9)) == 0:
            return {(data.draw(st.sampled_from(["xyz", 1, None, True])) if k == key else k): v for k, v in tree.items()}
        return {k: replaced(v, data) if k == key else v for k, v in tree.items()}
    if isinstance(tree, list) and tree and data.draw(st.integers(0, 7)):
        index = data.draw(st.integers(0, len(tree) - 1))
        return [replaced(v, data) if i == index else v for i, v in enumerate(tree)]
    return data.draw(odd_values)


@pytest.mark.slow
@given(st.data())
@settings(max_examples=150, deadline=None)
def test_odd_values_are_read_or_refused(data: st.DataObject) -> None:
    assert set(BASE) <= {*TOP_LEVEL, "cellwright"}
    text = yaml.safe_dump(replaced(BASE, data))
    with contextlib.suppress(DescriptionError):
        loaded = load(text).trial
        assert all(part.pose.is_finite() for part in loaded.bin_parts)


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
