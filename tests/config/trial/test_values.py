from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.trial import gear2017, values
from cellwright.util.errors import DescriptionError


def timestep(text: str) -> tuple[int, int]:
    return gear2017.load_trial(text=f"cellwright: {{timestep: {text}}}").trial.settings.timestep


@given(st.fractions(values.MIN_TIMESTEP, values.MAX_TIMESTEP, max_denominator=100_000))
def test_timestep_as_fraction_is_exact(step: Fraction) -> None:
    assert timestep(f"{step.numerator}/{step.denominator}") == (step.numerator, step.denominator)


@pytest.mark.parametrize(("text", "step"), [("0.002", (1, 500)), ("2e-3", (1, 500)), ("' 4 / 2000 '", (1, 500))])
def test_timestep_is_in_lowest_terms(text: str, step: tuple[int, int]) -> None:
    assert timestep(text) == step


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1/0", "must be seconds as a decimal or a fraction such as 1/500"),
        ("fast", "must be seconds as a decimal or a fraction such as 1/500"),
        ("0.03", "must be from 1/100000 to 1/50 s"),
    ],
)
def test_bad_timestep_is_refused(text: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        timestep(text)


@pytest.mark.parametrize(("text", "counts_as"), [("1", True), ("0", False), ("'no'", True), ("[]", False)])
def test_switch_that_is_no_truth_value_counts_as_in_python(text: str, counts_as: bool) -> None:
    loaded = gear2017.load_trial(text=f"options: {{insert_agvs: {text}}}")
    assert loaded.trial.options.insert_agvs is counts_as
    assert f"counts as {str(counts_as).lower()}" in str(loaded.warnings[0])


def test_initial_joint_beyond_its_limit_is_refused() -> None:
    text = "arm: {type: ur10}\ncellwright: {arm: {initial_joint_states: {linear_arm_actuator_joint: 2.2}}}"
    with pytest.raises(DescriptionError, match=r"must be within the joint's limits of ±2\.1 \(got 2\.2\)"):
        gear2017.load_trial(text=text)


def test_sensor_among_cameras_is_sent_to_its_section() -> None:
    text = "cellwright: {sensors: {a: {type: break_beam, pose: {xyz: [0, 0, 0]}}}}"
    with pytest.raises(DescriptionError, match="a break_beam belongs in the top-level section sensors"):
        gear2017.load_trial(text=text)
