"""Control space of a cell: order, names, units and ranges of the numbers of an action, and periods of whole ticks."""

import math
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright import load_trial
from cellwright.config.arm import ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT
from cellwright.config.control import TURN, ControlSpace, period_ticks
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.util.errors import UnknownNameError, UsageError
from tests.cell.arm_cells import ARMS, TWO_ON_A_RAIL, TWO_UR5
from tests.cell.robot_cells import arm_on_robot, tandem_cell

FINGERS = """
cell:
  arms:
    arm:
      model: {model}
      mount: {{kind: pedestal, at: [0, 0, 0.5]}}
      tip: tool0
      tool: {{kind: parallel, opening: 0.08}}
"""
TICK = (1, 500)


def space_of(text: str) -> ControlSpace:
    return ControlSpace.of(load_text(text=text.format(model=ARMS / "ur5.urdf")).trial)


def test_an_arm_has_its_joints_in_controller_order_and_its_suction() -> None:
    space = ControlSpace.of(load_trial("lesson"))
    assert space.names == (*ARM_JOINTS, "suction")
    rail, turn, suction = space.channels[0], space.channels[1], space.channels[-1]
    assert (rail.kind, rail.unit, rail.low, rail.high) == ("joint", "m", -RAIL_LIMIT, RAIL_LIMIT)
    assert (turn.unit, turn.low, turn.high) == ("rad", -TURN_LIMIT, TURN_LIMIT)
    assert (suction.kind, suction.unit, suction.low, suction.high) == ("suction", "", 0.0, 1.0)


def test_fingers_have_their_width() -> None:
    width = space_of(FINGERS).channels[-1]
    assert (width.name, width.kind, width.unit, width.low, width.high) == ("width", "width", "m", 0.0, 0.08)


def test_several_arms_have_distinct_names_and_those_of_their_messages() -> None:
    space = space_of(TWO_UR5)
    assert space.names[5:8] == ("arm1/wrist_3_joint", "arm1/suction", "arm2/shoulder_pan_joint")
    assert [(each.arm, each.joint) for each in space.channels[5:8]] == [
        ("arm1", "wrist_3_joint"),
        ("arm1", ""),
        ("arm2", "arm2_shoulder_pan_joint"),
    ]
    assert len(set(ControlSpace.of(load_text(text=TWO_ON_A_RAIL).trial).names)) == 16


def test_joints_of_a_robot_come_after_the_arms_in_file_order() -> None:
    trial = arm_on_robot()
    space, robot = ControlSpace.of(trial), trial.robot_models["qinglong"].robot
    assert space.names[6] == "suction"
    own = [joint.name for joint in robot.driven if joint.mimic is None]
    assert [each.joint for each in space.channels[7:]] == own
    assert {(each.robot, each.arm) for each in space.channels[7:]} == {("qinglong", "")}
    assert space.names[7] == f"qinglong/{own[0]}"


def test_every_range_has_two_ends() -> None:
    for space in (ControlSpace.of(tandem_cell()), ControlSpace.of(arm_on_robot()), space_of(TWO_UR5)):
        for each in space.channels:
            assert -math.inf < each.low < each.high < math.inf, each.name


def test_a_joint_that_turns_without_end_has_one_turn_to_either_side(tmp_path: Path) -> None:
    text = (ARMS / "ur5.urdf").read_text()
    (tmp_path / "endless.urdf").write_text(
        text.replace('wrist_3_joint" type="revolute', 'wrist_3_joint" type="continuous')
    )
    space = ControlSpace.of(load_text(text=FINGERS.format(model=tmp_path / "endless.urdf")).trial)
    wrist = space.channels[space.index("wrist_3_joint")]
    assert (wrist.unit, wrist.low, wrist.high) == ("rad", -TURN, TURN)


def test_a_cell_without_arms_and_robots_has_no_channels() -> None:
    assert ControlSpace.of(load_text(text="cell: {bins: {bin1: {at: [0.8, 0.0]}}}").trial).channels == ()


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=8, max_size=8))
def test_targets_are_within_ranges_and_kept_where_they_are(action: list[float]) -> None:
    space = ControlSpace.of(load_trial("lesson"))
    for channel, given_value, target in zip(space.channels, action, space.targets(action), strict=True):
        assert channel.low <= target <= channel.high
        assert target == given_value or not channel.low <= given_value <= channel.high


def test_wrong_actions_are_refused() -> None:
    space = ControlSpace.of(load_trial("lesson"))
    with pytest.raises(
        UsageError, match=r"action: must have 8 numbers \(got 7\); they are linear_arm_actuator_joint, "
    ):
        space.targets([0.0] * 7)
    with pytest.raises(UsageError, match=r"action: suction must be finite \(got nan\)"):
        space.targets([0.0] * 7 + [math.nan])
    with pytest.raises(UnknownNameError, match="elbow_joint"):
        space.index("elbo_joint")
    assert space.index("elbow_joint") == 3


@given(st.integers(1, 500))
def test_a_rate_of_whole_ticks_gives_them_back(ticks: int) -> None:
    assert period_ticks(float(Fraction(500, ticks)), TICK) == ticks


@given(st.integers(2, 200))
def test_rates_between_whole_ticks_are_refused_with_rates_that_are_taken(ticks: int) -> None:
    with pytest.raises(UsageError, match="must be whole ticks of 2 ms") as caught:
        period_ticks(1000.0 / (2 * ticks + 1), TICK)
    nearest, _, round_ones = str(caught.value).rsplit("take ", 1)[1].partition(" (or a round ")
    assert sorted(period_ticks(float(each), TICK) for each in nearest.split(" or ")) == [ticks, ticks + 1]
    for each in round_ones.rstrip(")").split(" or ") if round_ones else ():
        assert period_ticks(float(each), TICK)
        assert float(each) == round(float(each), 1)


@pytest.mark.parametrize("rate", [0.0, -20.0, 501.0, math.nan, math.inf])
def test_rates_out_of_range_are_refused(rate: float) -> None:
    with pytest.raises(UsageError, match="rate: must be above 0 and at most 500 Hz"):
        period_ticks(rate, TICK)
