"""Cellwright's own section: its settings, and errors for all mistakes."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.arm import ArmSettings, JointGains, JointTolerance
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import CellSettings
from cellwright.util.errors import DescriptionError


def settings(section: str) -> CellSettings:
    loaded = load_trial(text=f"cellwright: {section}")
    assert loaded.warnings == ()
    return loaded.trial.settings


def test_empty_settings_are_defaults() -> None:
    assert load_trial(text="").trial.settings == settings("{}") == settings("{arm: {}}") == CellSettings()


def test_settings_with_all_entries_are_read() -> None:
    section = """
  seed: 7
  timestep: 1/240
  collision_culling: false
  arm:
    servo: precise
    gains:
      elbow_joint: {p: 1000, d: 20, i: 1, i_clamp: 5}
      wrist_1_joint: {p: 10, d: 1}
    dry_friction: {linear_arm_actuator_joint: 500}
    constraints:
      goal_time: 2
      stopped_velocity_tolerance: 0
      elbow_joint: {trajectory: 0.2, goal: 0.05}
      wrist_1_joint: {goal: 0}
    stop_trajectory_duration: 0.25
    allow_partial_joints_goal: true
    initial_joint_states: {elbow_joint: pi/2, linear_arm_actuator_joint: -1.5}
"""
    assert settings(section) == CellSettings(
        seed=7,
        timestep=(1, 240),
        collision_culling=False,
        arm=ArmSettings(
            servo="precise",
            gains={"elbow_joint": JointGains(1000.0, 20.0, 1.0, 5.0), "wrist_1_joint": JointGains(10.0, 1.0)},
            dry_friction={"linear_arm_actuator_joint": 500.0},
            tolerances={"elbow_joint": JointTolerance(0.2, 0.05), "wrist_1_joint": JointTolerance(0.1, 0.0)},
            goal_time=2.0,
            stopped_velocity_tolerance=0.0,
            stop_trajectory_duration=0.25,
            allow_partial_joints_goal=True,
        ),
    )
    states = load_trial(text=f"cellwright: {section}").trial.initial_joint_states
    assert states == {"elbow_joint": math.pi / 2, "linear_arm_actuator_joint": -1.5}


@pytest.mark.parametrize(
    ("written", "step"),
    [("0.002", (1, 500)), ("1/500", (1, 500)), ("2/1000", (1, 500)), ("'0.001'", (1, 1000)), ("1e-3", (1, 1000))],
)
def test_timestep_notations_are_read_as_fraction(written: str, step: tuple[int, int]) -> None:
    assert settings(f"{{timestep: {written}}}").timestep == step


@given(st.integers(1, 2000), st.integers(1, 10**6))
def test_timestep_fraction_is_exact_or_refused(numerator: int, denominator: int) -> None:
    is_allowed = 50 * numerator <= denominator <= 100_000 * numerator
    try:
        p, q = settings(f"{{timestep: {numerator}/{denominator}}}").timestep
    except DescriptionError:
        p, q = 0, 0
    assert (p * denominator == q * numerator and p > 0) == is_allowed


@pytest.mark.parametrize(
    ("section", "expected"),
    [
        ("", "1: cellwright: must be a mapping (got an empty value)"),
        ("{sed: 1}", "1: cellwright.sed: unknown entry; did you mean seed"),
        ("{seed: -1}", "must be at least 0"),
        ("{collision_culling: maybe}", "must be true or false"),
        ("{seed: 1.5}", "must be a whole number"),
        ("{seed: 9223372036854775808}", "must be from 0 to 9223372036854775807 (got 9223372036854775808)"),
        ("{timestep: 0}", "must be from 1/100000 to 1/50 s (got 0)"),
        ("{timestep: 1}", "must be from 1/100000 to 1/50 s (got 1)"),
        ("{timestep: -0.002}", "must be seconds as a decimal or a fraction"),
        ("{timestep: 1/0}", "must be seconds as a decimal or a fraction"),
        ("{timestep: .nan}", "must be seconds as a decimal or a fraction"),
        ("{timestep: 2 ms}", "must be seconds as a decimal or a fraction"),
        ("{timestep: 1e-99}", "must be from"),
        ("{timestep: [1]}", "must be seconds as a decimal or a fraction"),
        ("{arm: ur10}", "must be a mapping"),
        ("{arm: {servos: precise}}", "unknown entry; did you mean servo"),
        ("{arm: {servo: exact}}", "unknown servo profile 'exact'"),
        ("{arm: {servo: precice}}", "did you mean precise"),
        (
            "{arm: {gains: {elbow: {p: 1, d: 1}}}}",
            "cellwright.arm.gains.elbow: unknown joint; did you mean elbow_joint",
        ),
        ("{arm: {dry_friction: {elbow_joint: -1}}}", "must not be negative (got -1)"),
        ("{arm: {dry_friction: {rail: 1}}}", "cellwright.arm.dry_friction.rail: unknown joint"),
        ("{arm: {gains: {elbow_joint: {p: 1}}}}", "the required entry 'd' is missing"),
        ("{arm: {gains: {elbow_joint: {p: 1, d: -1}}}}", "must not be negative (got -1)"),
        ("{arm: {gains: {elbow_joint: {p: 1, d: 1, k: 1}}}}", "unknown gain (known: p, d, i, i_clamp)"),
        ("{arm: {gains: {elbow_joint: {p: .inf, d: 1}}}}", "must be a finite number"),
        ("{arm: {constraints: {goal_tim: 1}}}", "unknown joint or entry; did you mean goal_time"),
        ("{arm: {constraints: {elbow_joint: 0.1}}}", "must be a mapping (got the number 0.1)"),
        ("{arm: {constraints: {elbow_joint: {path: 1}}}}", "unknown tolerance (known: trajectory, goal)"),
        ("{arm: {allow_partial_joints_goal: 1}}", "must be true or false (got the number 1)"),
        ("{arm: {stop_trajectory_duration: short}}", "must be a number (got the text 'short')"),
        ("{arm: {initial_joint_states: {elbow_joint: 7}}}", "must be within the joint's limits of ±6.28319 (got 7)"),
        (
            "{arm: {initial_joint_states: {linear_arm_actuator_joint: 2.2}}}",
            "must be within the joint's limits of ±2.1",
        ),
        ("{arm: {initial_joint_states: {elbow_joint: pie}}}", "not in Python's math module"),
        ("{arm: {initial_joint_states: [1]}}", "must be a mapping of joints to numbers"),
        ("{arm: {initial_joint_states: {elbow: 1}}}", "unknown joint; did you mean elbow_joint"),
    ],
)
def test_invalid_settings_are_refused(section: str, expected: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        settings(section)
    assert len(caught.value.problems) == 1
    assert expected in str(caught.value)
