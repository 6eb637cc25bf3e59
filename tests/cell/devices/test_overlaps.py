"""Overlapping parts stay in place, and gain no energy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest

from cellwright.cell.model.parts import PART_TYPES, part_type, separation_speed
from cellwright.config.trial.trial import Part
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, Floor
from tests.cell.model.bench import cell
from tests.support.places import BELT_SURFACE, BIN_CENTRES, BIN_SURFACE, TRAY_SURFACE

PLACES = {
    "belt": [(1.21, y, BELT_SURFACE) for y in np.arange(-3.2, 3.9, 0.5)],
    "bin": [(x, y, BIN_SURFACE) for x, y in BIN_CENTRES.values()],
    "tray": [(0.3, 3.15, TRAY_SURFACE), (0.3, -3.15, TRAY_SURFACE)],
}
SHARES = (0.05, 0.2, 0.4, 0.6, 0.9)
"""Overlap as a share of the narrower part's width."""

Overlap = tuple[str, str, float]

PAIRS: list[Overlap] = [
    (one, other, SHARES[number % len(SHARES)])
    for number, (one, other) in enumerate(itertools.combinations_with_replacement(PART_TYPES, 2))
]
ON_TRAYS = [pair for pair in PAIRS if not {"part1", "pulley_part"} & {*pair[:2]}][::5]
"""Pairs that fit on a tray, and few of them: there are two trays."""

AT_REST = 0.06
"""Speed [m/s] after three steps of free fall."""


def depth(pair: Overlap) -> float:
    """Return the overlap of the parts [m], along x."""
    widths = [upper[0] - lower[0] for lower, upper in (part_type(name).box for name in pair[:2])]
    return pair[2] * min(widths)


def put(pair: Overlap, place: Sequence[float], number: int) -> tuple[Part, Part]:
    """Return the parts of a pair, side by side along x with their overlap."""
    x, y, z = place
    (low, high), (other_low, _) = (part_type(name).box for name in pair[:2])
    left, right = Pose((x - high[0], y, z - low[2])), Pose((x - depth(pair) - other_low[0], y, z - other_low[2]))
    return Part(f"pair{number}|{pair[0]}_1", pair[0], left), Part(f"pair{number}|{pair[1]}_2", pair[1], right)


def chunks(where: str, pairs: list[Overlap]) -> list[tuple[str, list[Overlap]]]:
    """Split pairs into as many at once as there are places."""
    size = len(PLACES[where])
    return [(where, pairs[begin : begin + size]) for begin in range(0, len(pairs), size)]


@pytest.mark.slow
@pytest.mark.parametrize(("where", "pairs"), [*chunks("belt", PAIRS), *chunks("bin", PAIRS), *chunks("tray", ON_TRAYS)])
def test_overlapping_parts_stay_slow_and_close(where: str, pairs: list[Overlap]) -> None:
    both = [put(pair, place, number) for number, (pair, place) in enumerate(zip(pairs, PLACES[where], strict=False))]
    floor = Floor(cell(*itertools.chain(*both)))
    begin = {part.name: np.array(floor.pose(part.name).position) for part in itertools.chain(*both)}
    dofs = np.array([[floor.part(part.name).dof for part in parts] for parts in both])[:, :, None] + np.arange(3)
    fastest = np.zeros(len(both))
    for _ in range(5000):
        floor.cell.step()
        fastest = np.maximum(fastest, np.linalg.norm(floor.simulation.data.qvel[dofs], axis=2).max(axis=1))
    for pair, parts, speed in zip(pairs, both, fastest, strict=True):
        allowed = min(map(separation_speed, pair[:2]))
        # a part that is pushed out upwards falls from there
        fall = math.sqrt(2 * 9.81 * min(part_type(name).box[1][2] - part_type(name).box[0][2] for name in pair[:2]))
        assert speed < (AT_REST if allowed == 0.0 else max(allowed + AT_REST, fall)), pair
        for part in parts:
            assert math.dist(floor.pose(part.name).position, begin[part.name]) < depth(pair) + 1 * MM, pair


GEARS = put(("gear_part", "gear_part", 0.36), PLACES["bin"][6], 0)
"""50 mm apart, as in public scoring files of the time; a gear is 78 mm wide."""


@pytest.fixture
def floor() -> Floor:
    return Floor(cell(*GEARS, Part("bin|disk_part_3", "disk_part", Pose((-1.0, 0.995, BIN_SURFACE + 0.02)))))


def test_part_dropped_on_overlapping_gears_lies_on_top(floor: Floor) -> None:
    floor.run(1.0)
    gears = [floor.pose(part.name) for part in GEARS]
    assert math.dist(gears[0].position, gears[1].position) == pytest.approx(0.05, abs=1 * MM)
    x, y, z = gears[0].position
    floor.lay("bin|disk_part_3", x, y, z, above=0.05)
    floor.run(2.0)
    assert floor.pose("bin|disk_part_3").position[2] > z + 0.01
    assert [
        math.dist(floor.pose(part.name).position, pose.position) for part, pose in zip(GEARS, gears, strict=True)
    ] == (pytest.approx([0.0, 0.0], abs=0.5 * MM))


def test_part_placed_into_other_part_stays(floor: Floor) -> None:
    floor.run(1.0)
    assert len(floor.cell.overlaps.get_state()["pairs"]) == 1
    place = floor.pose(GEARS[1].name)
    disk = floor.part("bin|disk_part_3")
    floor.cell.parts.place(disk, Pose((place.position[0] + 0.06, *place.position[1:])))
    floor.run(5.0)
    assert math.dist(floor.pose(disk.name).position, place.position) == pytest.approx(0.06, abs=1 * MM)


def test_part_sunk_into_floor_is_not_pressed_further() -> None:
    gear = Part("bin|gear_part_1", "gear_part", Pose((-0.3, 0.23, BIN_SURFACE - 0.004)))
    floor = Floor(cell(gear))
    floor.run(0.5)
    height = floor.pose(gear.name).position[2]
    assert height == pytest.approx(BIN_SURFACE - 0.004, abs=0.5 * MM)
    floor.simulation.data.xfrc_applied[floor.part(gear.name).body, 2] = -60.0  # as the arm presses its cup onto it
    floor.run(1.0)
    assert floor.pose(gear.name).position[2] == pytest.approx(height, abs=0.5 * MM)


def test_separated_parts_collide_again(floor: Floor) -> None:
    floor.run(1.0)
    x, y, _ = floor.pose(GEARS[0].name).position
    floor.lay(GEARS[1].name, x + 0.2, y, BIN_SURFACE)
    floor.run(0.5)
    assert floor.cell.overlaps.get_state()["pairs"] == []
    assert not floor.cell.overlaps.stepping
    floor.lay(GEARS[1].name, x, y, BIN_SURFACE, above=0.05)
    floor.run(1.0)
    assert floor.pose(GEARS[1].name).position[2] > floor.pose(GEARS[0].name).position[2] + 0.008


def test_snapshot_with_overlaps_resumes_bit_for_bit(floor: Floor) -> None:
    floor.run(0.3)
    moment = take_snapshot(floor.simulation)
    floor.run(1.0)
    expected = floor.cell.state_hash()
    other = Floor(floor.cell.trial)
    restore_snapshot(other.simulation, moment)
    other.run(1.0)
    assert other.cell.state_hash() == expected


@pytest.mark.parametrize("parts", [0, 1])
def test_device_without_overlaps_stops_stepping(parts: int) -> None:
    floor = Floor(cell(*GEARS[:parts]))
    assert floor.cell.overlaps.stepping
    floor.cell.step()
    assert not floor.cell.overlaps.stepping


def test_part_that_leaves_is_forgotten(floor: Floor) -> None:
    floor.run(1.0)
    assert len(floor.cell.overlaps.get_state()["pairs"]) == 1
    floor.cell.parts.put_away(floor.part(GEARS[0].name))
    assert floor.cell.overlaps.get_state()["pairs"] == []
