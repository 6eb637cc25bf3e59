"""Several arms at work in one cell."""

from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.clients.agents.kitter.clearance import ARMS_APART, Clearance
from cellwright.clients.agents.kitter.crew import nearest, overview
from cellwright.clients.agents.kitter.described_arm import DescribedArm
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client.client import Client
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.motion import tool_down
from cellwright.running.run import Outcome, RunOptions, run_cell
from tests.cell.arm_cells import FACING_UR5, ur5_cell

TWO_ARMS = Path(__file__).parents[4] / "examples" / "cells" / "two_arms.yaml"
FACING = FACING_UR5
FACING += """\
  belts: {{belt: {{from: [0.6, 2.0], to: [0.6, -1.5], width: 0.3, surface: 0.45, speed: 0.12}}}}
  trays:
    far: {{at: [1.4, -0.5], size: [0.4, 0.3], surface: 0.45}}
    near: {{at: [-0.1, 0.5], size: [0.4, 0.3], surface: 0.45}}
orders: {{order_0: {{tray: near, parts: [{{type: gear_part, xy: [0, 0]}}]}}}}
"""


def facing(distance: float) -> Trial:
    """Return the trial of a cell with two UR5 that face each other, at a distance [m]."""
    return ur5_cell(FACING.replace("DISTANCE", str(distance)))


def described(client: Client) -> list[DescribedArm]:
    found = []
    for arm in client.layout().arms:
        device = client.arm(arm.namespace)
        client.sleep(0.1)
        chain, positions = client.chains()[arm.name], device.joint_positions
        found.append(DescribedArm(chain, arm, [positions[joint.name] for joint in chain.joints], highest=0.45))
    return found


@pytest.mark.slow
def test_two_arms_share_the_kits_stay_apart_and_end_in_same_state_twice() -> None:
    first, second = (
        run_cell(Cell(load_trial([TWO_ARMS]).trial), find_agent("kitter")(), RunOptions(until=150.0)) for _ in range(2)
    )
    assert (first.error, first.outcome, first.score.total) == ("", Outcome.DONE, 12.0)
    assert first.nearest_arms is not None
    assert first.nearest_arms.distance >= ARMS_APART
    assert second.state_hash == first.state_hash


def test_arms_too_near_to_each_other_at_home_are_refused() -> None:
    result = run_cell(Cell(facing(1.1)), find_agent("kitter")(), RunOptions(until=1.0))
    assert "UsageError: at home arm1_" in result.error
    assert "of arm2_" in result.error


def test_station_belongs_to_the_nearest_arm_and_belt_to_all_that_reach_it() -> None:
    client = Client.in_process(Cell(facing(1.3)))
    layout = client.layout()
    places = [Workplace(layout, each) for each in described(client)]
    numbers = {each.name: each.number for each in layout.trays}
    assert nearest(places) == {numbers["far"]: 1, numbers["near"]: 0}
    whole = overview(places)
    assert whole.stations[numbers["far"]] == places[1].stations[numbers["far"]]
    (belt,), ((left,), (right,)) = whole.belts, (each.belts for each in places)
    assert (belt.first, belt.last) == (min(left.first, right.first), max(left.last, right.last))
    assert overview(places[:1]) is places[0]


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
