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
from cellwright.config.trial.gear2017 import TOP_LEVEL, load_trial
from cellwright.config.trial.trial import Options, Trial
from cellwright.util.errors import DescriptionError, UsageError
from tests.config.trial.texts import GRID, ORDER, PART, conditional, error, errors, load, trial, warning

LESSON = find_trial("lesson").read_text()


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


def test_material_locations_do_not_depend_on_insertion() -> None:
    text = f"models_over_bins: {{bin3: {{models: {{gear_part: {GRID}}}}}}}"
    assert trial(text).material_locations["gear_part"] == ("bin3",)
    assert trial(text).bin_parts == ()
    assert "unless options.insert_models_over_bins is true" in warning(text)


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
