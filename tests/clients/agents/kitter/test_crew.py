"""Several arms at work in one cell."""

from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.clients.agents.kitter.clearance import ARMS_APART, Clearance
from cellwright.clients.agents.kitter.crew import nearest, share_out
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client.client import Client
from cellwright.config.trial.gear2017 import load_trial
from cellwright.motion import tool_down
from cellwright.running.run import Outcome, RunOptions, run_cell
from tests.clients.agents.kitter.facing import described, facing

TWO_ARMS = Path(__file__).parents[4] / "examples" / "cells" / "two_arms.yaml"

ONE_RAIL = """
cell:
  arms:
    arm1:
      mount: {kind: rail, at: [0.3, 0, 0.9]}
      home: &home
        linear_arm_actuator_joint: -1.2
        shoulder_pan_joint: 3.14
        shoulder_lift_joint: -1.1
        elbow_joint: 1.5
        wrist_1_joint: 3.7
        wrist_2_joint: -1.57
    arm2:
      mount: {kind: rail, at: [0.3, 0, 0.9]}
      home: {<<: *home, linear_arm_actuator_joint: 1.2}
  bins: {bin1: {at: [-0.3, -1.0], size: [0.6, 0.6]}, bin2: {at: [-0.3, 1.0], size: [0.6, 0.6]}}
  trays: {table1: {at: [1.2, -1.0]}, table2: {at: [1.2, 1.0]}}
  sensors:
    logical_camera_bin1: {type: logical_camera, over: bin1, height: 0.65}
    logical_camera_bin2: {type: logical_camera, over: bin2, height: 0.65}
    logical_camera_tray1: {type: logical_camera, over: table1, height: 0.7}
    logical_camera_tray2: {type: logical_camera, over: table2, height: 0.7}
parts: [{type: gear_part, in: bin1, grid: [2, 2]}, {type: gear_part, in: bin2, grid: [2, 2]}]
orders:
  order_0:
    kits:
      - {tray: table1, parts: [{type: gear_part, xy: [0, 0]}]}
      - {tray: table2, parts: [{type: gear_part, xy: [0, 0]}]}
"""


@pytest.mark.slow
def test_two_arms_on_one_rail_carry_parts_over_it_at_once_and_end_in_same_state_twice() -> None:
    first, second = (
        run_cell(Cell(load_trial(text=ONE_RAIL).trial), find_agent("kitter")(), RunOptions(until=40.0))
        for _ in range(2)
    )
    assert (first.error, first.outcome, first.score.total) == ("", Outcome.DONE, 6.0)
    # a kit takes 12 s
    assert first.simulated < 20.0
    assert second.state_hash == first.state_hash


@pytest.mark.slow
def test_two_arms_work_at_once_and_stay_apart() -> None:
    result = run_cell(Cell(load_trial([TWO_ARMS]).trial), find_agent("kitter")(), RunOptions(until=150.0))
    assert (result.error, result.outcome, result.score.total) == ("", Outcome.DONE, 18.0)
    # in turns they need 64 s
    assert result.simulated < 50.0
    assert result.nearest_arms is not None
    assert result.nearest_arms.distance >= ARMS_APART


def test_arms_too_near_to_each_other_at_home_are_refused() -> None:
    result = run_cell(Cell(facing(1.1)), find_agent("kitter")(), RunOptions(until=1.0))
    assert "UsageError: at home arm1_" in result.error
    assert "of arm2_" in result.error


def test_station_belongs_to_the_nearest_arm_and_belt_to_each_from_its_stretch_on() -> None:
    client = Client.in_process(Cell(facing(1.3)))
    layout = client.layout()
    places = [Workplace(layout, each) for each in described(client)]
    numbers = {each.name: each.number for each in layout.trays}
    assert nearest(places) == {numbers["far"]: 1, numbers["near"]: 0}
    left, right = share_out(places)
    assert (set(left.stations), [each.number for each in left.others]) == ({numbers["near"]}, [numbers["far"]])
    assert (set(right.stations), [each.number for each in right.others]) == ({numbers["far"]}, [numbers["near"]])
    # the belt comes from y = 2 m: first past the tray of the left arm
    (upper,), (lower,), (whole,) = left.belts, right.belts, places[1].belts
    assert upper == places[0].belts[0]
    assert lower.first == pytest.approx((upper.first + max(upper.last, whole.last)) / 2)
    assert lower.last == whole.last
    assert share_out(places[:1])[0] is places[0]


def test_motion_towards_another_arm_is_stopped_before_it_is_near() -> None:
    client = Client.in_process(Cell(facing(1.3)))
    one, other = described(client)
    solids, chains = client.solids(), client.chains()
    alone = Clearance(solids, chains["arm1"], one)
    beside = Clearance(solids, chains["arm1"], one, [(chains["arm2"], other)])
    x, _, z = other.tool(other.figures.home).position
    start = next(one.usual(tool_down(x - 0.35, 0.0, z), 0.0, one.figures.home))
    way = [start]
    for step in range(1, 16):
        found = one.step(tool_down(x - 0.35 + 0.02 * step, 0.0, z), way[-1])
        assert found is not None
        way.append(found)
    assert alone.obstacle(way) is None
    stopped = beside.obstacle(way)
    assert stopped is not None
    assert stopped.other.startswith("arm2_")
    assert 0.03 < stopped.distance < ARMS_APART + 0.005
