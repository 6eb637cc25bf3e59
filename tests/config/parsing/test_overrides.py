"""Tests of overrides: a trial with one equals that of a file with its value; one without effect is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright import load_trial
from cellwright.config.parsing import overrides as overrides_module
from cellwright.config.parsing.overrides import MAX_OVERRIDES, Override, read_values
from cellwright.config.parsing.tree import Problem
from cellwright.config.trial import gear2017
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import resolved, resolved_cell
from cellwright.util.errors import DescriptionError, UsageError

WRITTEN = """
arm: {type: ur10}
time_limit: %(time_limit)s
options: {insert_models_over_bins: true, spawn_extra_models: true, belt_population_cycles: %(cycles)s}
models_over_bins:
  bin7:
    models:
      gear_part:
        {xyz_start: [0.1, 0.1, 0], xyz_end: [%(end)s, 1, 0], rpy: [0, 0, pi/4], num_models_x: 3, num_models_y: 4}
belt_parts: {gear_part: {6.0: {pose: {xyz: [0, 0, %(height)s]}}, 7: {pose: {rpy: [0, 0, 1]}}}}
models_to_spawn: {"bin1::link": {models: {one: {type: %(type)s, pose: {xyz: [0, 0, 1]}}}}}
orders:
  order_0:
    announcement_condition: time
    announcement_condition_value: %(value)s
    parts: {part_0: {type: gear_part, pose: {xyz: [0.1, 0, 0], rpy: %(rpy)s}}}
faulty_parts: [gear_part_1, %(faulty)s]
cellwright: {seed: %(seed)s, timestep: %(timestep)s, arm: %(arm)s}
"""
USUAL = {
    "time_limit": "60",
    "cycles": "2",
    "end": "0.5",
    "height": "0.1",
    "type": "disk_part",
    "value": "0",
    "rpy": "[0, 0, 1]",
    "faulty": "gear_part_2",
    "seed": "1",
    "timestep": "1/500",
    "arm": "{}",
}
KEYS = {
    "time_limit": "time_limit",
    "cycles": "options.belt_population_cycles",
    "end": "models_over_bins.bin7.models.gear_part.xyz_end[0]",
    "height": "belt_parts.gear_part.6.0.pose.xyz[2]",
    "type": "models_to_spawn.bin1::link.models.one.type",
    "value": "orders.order_0.announcement_condition_value",
    "rpy": "orders.order_0.parts.part_0.pose.rpy",
    "faulty": "faulty_parts[1]",
    "seed": "cellwright.seed",
    "timestep": "cellwright.timestep",
    "arm": "cellwright.arm",
}


def outcome(text: str, *overrides: str) -> tuple[Any, tuple[Problem, ...]]:
    """Return all that a trial is made of, None after an error; and the warnings."""
    try:
        loaded = gear2017.load_trial(text=text, overrides=[Override.read(each) for each in overrides])
    except DescriptionError:
        return None, ()
    found = repr((resolved(loaded), resolved_cell(loaded.trial), loaded.time_limit, loaded.faulty_parts))
    return (found, loaded.trial), loaded.warnings


NUMBERS = st.integers(-3, 700).map(str) | st.floats(-2, 2).map(lambda number: f"{number:.3f}")
WORDS = st.sampled_from(
    [
        *(
            "true",
            "yes",
            "~",
            "''",
            "1e3",
            "010",
            "1:30",
            "0x10",
            ".5",
            "pi/4",
            "1/1000",
            "1/0",
            "'7'",
            "a",
            "2017-04-01",
        ),
        *("gear_part", "gear_part_2", "gear_part_clone_1", "precise", "[]", "{}", "[0, 0, 2]", "[0, 0, 3/2]", "[0, 0]"),
        *(
            "{servo: precise}",
            "{servo: precse}",
            "{gains: {elbow_joint: {p: 1, d: 2}}}",
            "{xyz: [1]}",
            "[[1], 2]",
            "[1",
        ),
    ]
)


@given(st.sampled_from(sorted(KEYS)), NUMBERS | WORDS)
def test_override_equals_file_with_that_value(name: str, value: str) -> None:
    key = KEYS[name]
    written, warnings = outcome(WRITTEN % (USUAL | {name: value}))
    overridden, _ = outcome(WRITTEN % USUAL, f"{key}={value}")
    is_refused = any(each.key.startswith(key) or (each.ignored and key.startswith(each.ignored)) for each in warnings)
    assert overridden == (None if is_refused else written)


def test_value_that_disables_another_section_is_no_error() -> None:
    text, override = WRITTEN % USUAL, Override.read("options.belt_population_cycles=0")
    (warning,) = gear2017.load_trial(text=text, overrides=[override]).warnings
    assert str(warning).endswith("belt_parts: no effect on the cell unless options.belt_population_cycles is above 0")


def test_usual_values_make_a_trial_without_warnings() -> None:
    loaded = gear2017.load_trial(text=WRITTEN % USUAL)
    assert (loaded.warnings, len(loaded.trial.orders), len(loaded.trial.extra_parts)) == ((), 1, 1)


def test_several_overrides_apply_in_their_order() -> None:
    trial = load_trial("lesson", overrides=["time_limit=60", "time_limit=70", "cellwright.seed=3"])
    assert (trial.time_limit, trial.settings.seed) == (70.0, 3)
    assert trial.overrides == ("time_limit=60", "time_limit=70", "cellwright.seed=3")


@pytest.mark.parametrize("text", ["", "{}", "cellwright:", "cellwright: {arm: ~}", "cellwright: {seed: 0}"])
def test_missing_mappings_are_made(text: str) -> None:
    trial = load_trial(text=text, overrides=["cellwright.arm.gains.elbow_joint={p: 3, d: 4}"])
    assert trial.settings.arm.gains["elbow_joint"].p == 3


def test_new_entry_comes_last_and_its_key_is_a_yaml_scalar() -> None:
    text = "belt_parts: {gear_part: {9: {pose: {xyz: [0, 0, 0]}}}}"
    written = "belt_parts: {gear_part: {9: {pose: {xyz: [0, 0, 0]}}, 4: {pose: {xyz: [1, 0, 0]}}}}"
    trial = load_trial(text=text, overrides=["belt_parts.gear_part.4.pose.xyz=[1, 0, 0]"])
    assert trial == load_trial(text=written)
    assert [part.time for part in trial.belt_parts] == [4.0, 9.0]


def test_override_leaves_value_of_an_alias_elsewhere() -> None:
    text = "sensors: {a: &s {type: break_beam, pose: {xyz: [1, 2, 3]}}, b: *s}"
    first, second = load_trial(text=text, overrides=["sensors.b.pose.xyz[0]=5"]).sensors
    assert (first.pose.position, second.pose.position) == ((1, 2, 3), (5, 2, 3))


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("options.belt_cycles=2", "options.belt_cycles: unknown option, ignored"),
        ("options.belt_population_cycle=2", "unknown option, ignored; did you mean belt_population_cycles"),
        ("option.insert_agvs=true", "option: unknown top-level entry; did you mean options"),
        ("orders.order_0.kitcount=2", "orders.order_0.kitcount: unknown entry, ignored; did you mean kit_count"),
        ("arm.initial_joint_states.elbow_joint=1", "move it to cellwright: arm:"),
        ("options.insert_agvs=maybe", "options.insert_agvs: should be true or false (got the text 'maybe')"),
        ("faulty_parts=[gear_part_77]", "faulty_parts[0]: no part is called 'gear_part_77'"),
        ("cellwright.arm.srvo=precise", "cellwright.arm.srvo: unknown entry; did you mean servo"),
        ("models_to_spawn.world.models.a={type: gear_part, pose: {}}", "unless options.spawn_extra_models is true"),
        ("options.fill_demo_tray=true", "options.fill_demo_tray: no effect without a tray"),
        ("sensors.x={type: camera, pose: {}}", "sensors.x.type: unknown sensor type 'camera', the sensor is left out"),
        ("time_limit=abc", "time_limit: must be a number (got the text 'abc')"),
        ("time_limit=[1", "time_limit: invalid YAML"),
        ("time_limit=!!python/name:os.system", "time_limit: the tag "),
        ("time_limit.x=1", "time_limit.x: time_limit is the number 500; it has no entries"),
        ("models_over_bins.bin7.models.gear_part.rpy[3]=1", "rpy is a list of 3; give an index from [0] to [2]"),
        ("models_over_bins.bin7.models.gear_part.rpy.z=1", "rpy is a list of 3; give an index from [0] to [2]"),
        ("faulty_parts[0]=gear_part_1", "faulty_parts[0]: faulty_parts is an empty list"),
        ("drops[0]=1", "drops[0]: there is no list drops; set it as a whole"),
        ("orders[0]=1", "orders[0]: orders is a mapping; give a path"),
        (".orders=1", ".orders: not a path; give a path"),
        ("a." * 60 + "a=1", "nested deeper than 50 levels"),
    ],
)
def test_override_without_effect_is_refused(override: str, expected: str) -> None:
    text = """{arm: {type: ur10}, time_limit: 500, faulty_parts: [],
        options: {insert_agvs: false, insert_models_over_bins: true},
        models_over_bins: {bin7: {models: {gear_part: {xyz_start: [0, 0, 0], xyz_end: [1, 1, 0], rpy: [0, 0, 0],
            num_models_x: 2, num_models_y: 2}}}},
        orders: {order_0: {announcement_condition: time, announcement_condition_value: 0,
            parts: {one: {type: gear_part, pose: {}}}}}}"""
    with pytest.raises(DescriptionError) as caught:
        load_trial(text=text, overrides=[override])
    (line,) = str(caught.value).splitlines()
    assert line.startswith("overrides: ")
    assert expected in line


@pytest.mark.parametrize(
    ("text", "override", "expected"),
    [
        (
            "options: {belt_population_cycles: 0}\nbelt_parts: {gear_part: {1.0: {pose: {xyz: [0, 0, 0]}}}}",
            "belt_parts.gear_part.1.0.pose.xyz[0]=1",
            (
                "overrides: belt_parts.gear_part.1.0.pose.xyz[0]: no effect on the cell unless "
                "options.belt_population_cycles is above 0 (<text>:2: belt_parts)"
            ),
        ),
        (
            "sensors:\n  a: {type: brake_beam, pose: {xyz: [0, 0, 0]}}",
            "sensors.a.pose.xyz[0]=1",
            (
                "overrides: sensors.a.pose.xyz[0]: unknown sensor type 'brake_beam', the sensor is left out; "
                "did you mean break_beam (<text>:2: sensors.a.type)"
            ),
        ),
        (
            "options: {more: {a: 1}}",
            "options.more.a=2",
            "overrides: options.more.a: unknown option, ignored (<text>:1: options.more)",
        ),
    ],
)
def test_override_inside_of_something_ignored_is_refused(text: str, override: str, expected: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        load_trial(text=text, overrides=[override])
    assert str(caught.value) == expected


def test_warnings_about_other_values_stay_warnings() -> None:
    text = "{options: {insert_agv: true}, belt_parts: {gear_part: {1.0: {pose: {}}}}}"
    loaded = gear2017.load_trial(text=text, overrides=[Override.read("options.belt_population_cycles=0")])
    assert [problem.key for problem in loaded.warnings] == ["options.insert_agv", "belt_parts"]


def test_too_many_overrides_and_values_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DescriptionError, match=f"too many overrides .got {MAX_OVERRIDES + 1}, at most {MAX_OVERRIDES}"):
        load_trial("lesson", overrides=["time_limit=1"] * (MAX_OVERRIDES + 1))
    monkeypatch.setattr(overrides_module, "MAX_NODES", 5)
    with pytest.raises(DescriptionError, match="more than 5 values"):
        load_trial("lesson", overrides=["faulty_parts=[gear_part_1]", "faulty_parts=[a, b, c]"])


def test_too_long_key_is_refused() -> None:
    with pytest.raises(UsageError, match=r"overrides: a key must have at most 500 characters \(got 501\)"):
        Override.read("a" * 501 + "=1")


@pytest.mark.parametrize("text", ["", "time_limit", "=5", " = 5"])
def test_text_without_key_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="overrides: must be KEY=VALUE"):
        load_trial("lesson", overrides=[text])


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("", []),
        ("60", ["60"]),
        ("0, 1.50,-1.5", ["0", "1.50", "-1.5"]),
        ("[0, 0.1], {type: x}, true,", ["[0, 0.1]", "{type: x}", "true"]),
        ("'a, b', \"c\", pi/2", ["'a, b'", '"c"', "pi/2"]),
    ],
)
def test_values_keep_their_text(text: str, values: list[str]) -> None:
    assert read_values("--sweep x", text) == values


@pytest.mark.parametrize("text", ["1,,2", "[1", "1]", "1], [2", "1 # 2", "*a", "\t-", "\x00"])
def test_other_texts_are_no_values(text: str) -> None:
    with pytest.raises(UsageError, match=r"^--sweep x: .*; write them as in 60,120") as caught:
        read_values("--sweep x", text)
    assert str(caught.value).isprintable()


def test_override_of_joined_files_is_that_of_their_text(tmp_path: Path) -> None:
    (tmp_path / "more.yaml").write_text("cellwright: {seed: 4}\n", encoding="utf-8")
    files = [find_trial("lesson"), tmp_path / "more.yaml"]
    loaded = gear2017.load_trial(files, overrides=[Override.read("cellwright.seed=5", "--set")])
    assert loaded.trial.settings.seed == 5
    with pytest.raises(DescriptionError, match=r"^--set: cellwright\.sed: unknown entry; did you mean seed$"):
        gear2017.load_trial(files, overrides=[Override.read("cellwright.sed=5", "--set")])
