"""Regions of several arms."""

import math

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.clearance import ARMS_APART, SERVOS
from cellwright.clients.agents.kitter.described_arm import DescribedArm
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.regions import HALF_STEP, Lane, Regions
from cellwright.clients.client.client import Client
from cellwright.motion import tool_down
from cellwright.motion.solver import Vector
from tests.clients.agents.kitter.facing import described, facing


@pytest.fixture(scope="module")
def arms() -> tuple[Client, list[DescribedArm]]:
    client = Client.in_process(Cell(facing(1.3)))
    return client, described(client)


def regions_of(arms: tuple[Client, list[DescribedArm]]) -> Regions:
    client, postures = arms
    return Regions(client.solids(), [*zip(client.chains().values(), postures, strict=True)])


def over(arm: DescribedArm, x: float, y: float) -> Vector:
    return next(arm.usual(tool_down(x, y, 0.65), 0.0, arm.figures.home))


def test_arm_does_not_enter_where_another_one_may_be(arms: tuple[Client, list[DescribedArm]]) -> None:
    regions, (one, other) = regions_of(arms), arms[1]
    first, second = Lane(regions, 0), Lane(regions, 1)
    place, way = over(one, 0.65, 0.3), [other.figures.home, over(other, 0.65, 0.3)]
    assert second.enter(way, None) is None, "at home the first one is not in the way"
    second.leave()
    assert first.enter([one.figures.home, place], None) is None
    found = second.enter(way, None)
    assert found is not None
    assert (found.moving.partition("_")[0], found.other.partition("_")[0]) == ("arm2", "arm1")
    assert second.enter([other.figures.home, over(other, 0.65, -0.4)], None) is None
    assert second.enter(way, None) is not None, "the first one may be anywhere on its way"
    first.leave()
    assert second.enter(way, None) is None


def test_distance_between_arms_is_that_of_their_nearest_shapes(arms: tuple[Client, list[DescribedArm]]) -> None:
    regions, (one, other) = regions_of(arms), arms[1]
    first, second = Lane(regions, 0), Lane(regions, 1)
    first.keep([over(one, 0.65, 0.3)], None)
    near = second.enter([over(other, 0.79, 0.3)], None)
    assert near is not None
    assert near.distance < ARMS_APART
    # two arms may come nearer between the places that are compared, and by the errors of their servos
    free = 0.79 + math.hypot(ARMS_APART, 2 * HALF_STEP) + SERVOS - near.distance
    found = second.enter([over(other, free - 0.002, 0.3)], None)
    assert found is not None
    assert found.distance == pytest.approx(near.distance + free - 0.792, abs=2e-4)
    assert second.enter([over(other, free + 0.002, 0.3)], None) is None


def test_load_on_the_cup_counts(arms: tuple[Client, list[DescribedArm]]) -> None:
    regions, (one, other) = regions_of(arms), arms[1]
    first, second = Lane(regions, 0), Lane(regions, 1)
    pulley = Catalogue().figures("pulley_part")
    first.keep([over(one, 0.65, 0.3)], None)
    assert second.enter([over(other, 0.86, 0.3)], None) is None
    found = second.enter([over(other, 0.86, 0.3)], pulley)
    assert found is not None
    assert found.moving == "load"


def test_arm_is_in_the_way_while_another_one_waits(arms: tuple[Client, list[DescribedArm]]) -> None:
    regions, (one, other) = regions_of(arms), arms[1]
    first, second = Lane(regions, 0), Lane(regions, 1)
    first.keep([over(one, 0.65, 0.3)], None)
    assert second.enter([over(other, 0.65, 0.3)], None) is not None
    seen: list[bool] = []
    client = arms[0]
    client.subscribe("/clock", lambda _message: seen.append(first.is_in_the_way))
    began = client.time
    second.wait(client, 0.5)
    assert client.time - began == pytest.approx(0.5)
    assert set(seen) == {True}
    assert not first.is_in_the_way
    # the first one gives its place back meanwhile
    client.subscribe("/clock", lambda _message: first.leave() if client.time > began + 0.7 else None)
    second.wait(client, 0.5)
    assert client.time - began == pytest.approx(0.702, abs=0.003)
