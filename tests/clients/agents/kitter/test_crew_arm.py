"""Two arms that are in each other's way."""

import math
from collections.abc import Callable

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.arm_guard import ArmDistances
from cellwright.clients.agents.kitter.clearance import ARMS_APART, Clearance
from cellwright.clients.agents.kitter.crew_arm import MAX_WAIT, CrewArm
from cellwright.clients.agents.kitter.regions import Lane, Regions
from cellwright.clients.agents.kitter.turns import Turns
from cellwright.clients.client.client import Client
from cellwright.motion import tool_down
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.facing import described, facing

PLACE = tool_down(0.65, 0.35, 0.65)


class Pair:
    """Two arms that face each other, each in a program of its own."""

    def __init__(self) -> None:
        self.cell = Cell(facing(1.3))
        client = Client.in_process(self.cell)
        postures, solids = described(client), client.solids()
        chains = [*zip(client.chains().values(), postures, strict=True)]
        regions = Regions(solids, chains)
        self.turns = Turns(client.transport, 2)
        self.arms: list[CrewArm] = []

        def arm(index: int) -> CrewArm:
            own = self.turns.clients[index]
            clearance = Clearance(solids, *chains[index], [chains[1 - index]])
            device = own.arm(f"arm{index + 1}")
            return CrewArm(own, device, postures[index], clearance, 0.45, Lane(regions, index))

        self.arms = self.turns.run([lambda: arm(0), lambda: arm(1)])
        self.least = math.inf
        """Least distance of the arms so far [m]."""
        distances = ArmDistances(self.cell.simulation, self.cell.trial)

        def measure(_message: object) -> None:
            found = distances.nearest("arm1", "arm2", self.least)
            self.least = self.least if found is None else found.distance

        client.adopt()
        client.subscribe("/ariac/arm1/joint_states", measure)

    def run(self, *programs: Callable[[], bool]) -> list[bool]:
        return self.turns.run(programs)

    def is_at(self, index: int, place: Pose) -> bool:
        return self.arms[index].tool.position == pytest.approx(place.position, abs=0.01)

    def is_at_home(self, index: int) -> bool:
        arm = self.arms[index]
        return self.is_at(index, arm.postures.tool(arm.postures.figures.home))


def test_arm_that_waits_for_something_makes_way() -> None:
    pair = Pair()
    one, other = pair.arms

    def first() -> bool:
        return one.travel(PLACE, 0.0) and not one.wait_until(lambda: False, 15.0)

    assert pair.run(first, lambda: other.travel(PLACE, 0.0)) == [True, True]
    assert (pair.is_at_home(0), pair.is_at(1, PLACE)) == (True, True)
    assert pair.least >= ARMS_APART


def test_two_arms_that_want_to_go_where_the_other_one_is_both_arrive() -> None:
    pair = Pair()
    one, other = pair.arms
    left, right = tool_down(0.65, 0.35, 0.65), tool_down(0.65, -0.35, 0.65)

    def first() -> bool:
        done = one.travel(left, 0.0) and one.travel(right, 0.0) and pair.is_at(0, right)
        one.wait_until(lambda: False, 20.0)
        return done

    def second() -> bool:
        done = other.travel(right, 0.0) and other.travel(left, 0.0) and pair.is_at(1, left)
        other.wait_until(lambda: False, 20.0)
        return done

    assert pair.run(first, second) == [True, True]
    assert pair.least >= ARMS_APART


def test_arm_gives_up_if_the_other_one_does_not_make_way() -> None:
    pair = Pair()
    one, other = pair.arms
    client = pair.turns.clients[0]

    def first() -> bool:
        there = one.travel(PLACE, 0.0)
        client.sleep(MAX_WAIT + 5.0)
        return there

    def second() -> bool:
        other._client.sleep(2.0)
        return other.travel(PLACE, 0.0)

    assert pair.run(first, second) == [True, False]
    assert (pair.is_at(0, PLACE), pair.is_at_home(1)) == (True, True)
