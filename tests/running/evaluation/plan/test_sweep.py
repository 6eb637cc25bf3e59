"""Tests of sweeps: their text, their combinations, and keys without effect."""

from __future__ import annotations

import pytest

from cellwright.config.parsing.overrides import Override
from cellwright.config.trial.gear2017 import load_trial
from cellwright.running.evaluation.plan.sweep import MAX_VARIANTS, Sweep, check_effect, variant_name, variants
from cellwright.util.errors import DescriptionError, UsageError

TEXT = "{options: {belt_population_cycles: 1}, belt_parts: {gear_part: {1: {pose: {xyz: [0, 0, 0]}}}}}"


def trials(*sweeps: str) -> None:
    """Load a trial with all values of sweeps, and check that each key has an effect."""
    read = [Sweep.read(each) for each in sweeps]
    check_effect(read, [load_trial(text=TEXT, overrides=each).trial for each in variants(read)])


def test_sweep_keeps_texts_of_its_values() -> None:
    sweep = Sweep.read("orders.order_0.parts.part_1.pose.xyz[0] = 0, 0.10, [1, 2], {type: x}, -1.5, true")
    assert sweep.key == "orders.order_0.parts.part_1.pose.xyz[0]"
    assert sweep.values == ("0", "0.10", "[1, 2]", "{type: x}", "-1.5", "true")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time_limit", r"^--sweep: must be KEY=A,B,C \(got 'time_limit'\); write it as in time_limit=60,120"),
        ("=1,2", "must be KEY=A,B,C"),
        ("time_limit='\n',2", "must be KEY=A,B,C"),
        ("time_limit=", "^--sweep time_limit: no value given"),
        ("time_limit=1,2,1", "^--sweep time_limit: 1 is given twice"),
        ("time_limit=1,[2", r"^--sweep time_limit: invalid YAML: .* in '1,\[2'; write them as in"),
    ],
)
def test_other_texts_are_refused(text: str, expected: str) -> None:
    with pytest.raises(UsageError, match=expected):
        Sweep.read(text)


def test_several_sweeps_give_all_combinations_the_last_fastest() -> None:
    found = variants([Sweep.read("a=1,2"), Sweep.read("b=x,y")])
    assert [variant_name("lesson", each) for each in found] == [
        "lesson a=1 b=x",
        "lesson a=1 b=y",
        "lesson a=2 b=x",
        "lesson a=2 b=y",
    ]
    assert found[1] == (Override("a", "1"), Override("b", "y"))
    assert variants([]) == [()]
    assert variant_name("lesson", ()) == "lesson"


def test_repeated_key_and_too_many_combinations_are_refused() -> None:
    with pytest.raises(UsageError, match="--sweep a: the key is given twice; list its values in one --sweep"):
        variants([Sweep.read("a=1"), Sweep.read("a=2")])
    many = ",".join(map(str, range(40)))
    with pytest.raises(UsageError, match=rf"at most {MAX_VARIANTS} combinations \(got 1600\)"):
        variants([Sweep.read(f"a={many}"), Sweep.read(f"b={many}")])


@pytest.mark.parametrize(
    "sweeps",
    [
        (),
        ("time_limit=500",),
        ("time_limit=60,60.0,70",),
        ("options.belt_population_cycles=0,1",),
        ("time_limit=1,2", "cellwright.arm.servo=original,precise"),
    ],
)
def test_key_with_effect_is_accepted(sweeps: tuple[str, ...]) -> None:
    trials(*sweeps)


@pytest.mark.parametrize(
    ("sweeps", "key"),
    [
        (("time_limit=60,60.0",), "time_limit"),
        (("time_limit=1,2", "options.insert_agvs=true,yes"), "options.insert_agvs"),
        (("options.insert_agvs=true,yes", "time_limit=1,2"), "options.insert_agvs"),
        (("options.disable_shadows=true,false",), "options.disable_shadows"),
        (("cellwright={seed: 1},{seed: 2}",), "cellwright"),
    ],
)
def test_key_without_effect_is_refused(sweeps: tuple[str, ...], key: str) -> None:
    with pytest.raises(UsageError, match=rf"^--sweep {key}: .* make the same trial text"):
        trials(*sweeps)


def test_seed_is_refused_since_each_run_has_its_own() -> None:
    with pytest.raises(UsageError, match=r"^--sweep cellwright\.seed: each run .* use --seeds$"):
        trials("cellwright.seed=1")


def test_ignored_key_is_refused_by_its_option() -> None:
    with pytest.raises(DescriptionError, match=r"^--sweep: options\.belt_cycles: unknown option, ignored"):
        trials("options.belt_cycles=1,2")
    with pytest.raises(
        DescriptionError, match=r"no effect on the cell unless options\.belt_population_cycles is above 0"
    ):
        trials("options.belt_population_cycles=0,1", "belt_parts.gear_part.1.pose.xyz[0]=0,1")
