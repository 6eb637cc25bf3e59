"""Parts at rest stay in place, even without sleep."""

from collections.abc import Iterator

import numpy as np
import pytest

from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.trial.trial import Part
from cellwright.util.pose import Pose
from tests.cell.model.bench import MM, Bench, cell, part_on
from tests.support.places import AGV_T_TRAY, BELT_SURFACE, BIN_CENTRES, BIN_SURFACE, TRAY_IDS, TRAY_SURFACE

ON_TRAY = {
    "gear_part": ("agv1", -0.15, -0.2),
    "disk_part": ("agv1", 0.1, -0.2),
    "gasket_part": ("agv1", -0.1, 0.0),
    "piston_rod_part": ("agv1", 0.15, 0.0),
    "part2": ("agv1", -0.1, 0.2),
    "part4": ("agv1", 0.1, 0.2),
    "pulley_part": ("agv2", -0.05, -0.2),
    "part1": ("agv2", 0.0, 0.05),
    "part3": ("agv2", -0.05, 0.2),
}


def everywhere() -> Iterator[Part]:
    """Yield one part of each type in a bin, on the belt, and on a tray."""
    for number, kind in enumerate(PART_TYPES):
        x, y = BIN_CENTRES[f"bin{number % 8 + 1}"]
        yield part_on(kind, x + 0.2 * (number // 8), y, BIN_SURFACE, name=f"bin|{kind}")
        yield part_on(kind, 1.21, -3.0 + 0.8 * number, BELT_SURFACE, name=f"belt|{kind}")
        agv, tx, ty = ON_TRAY[kind]
        z = TRAY_SURFACE - AGV_T_TRAY.position[2] - part_type(kind).bottom + 1e-4
        yield Part(f"tray|{kind}", kind, Pose((tx, ty, z)), TRAY_IDS[agv])


def drift(bench: Bench, seconds: float) -> dict[str, float]:
    """Return the distance [m] that each part moves in `seconds` of rest, after settling for a second."""
    bench.run(1.0)
    before = {part.name: bench.position(part) for part in bench.world.parts}
    bench.run(seconds)
    return {p.name: float(np.linalg.norm(bench.position(p) - before[p.name])) for p in bench.world.parts}


@pytest.mark.slow
def test_parts_at_rest_in_bins_on_belt_and_trays_do_not_drift() -> None:
    moved = drift(Bench(cell(*everywhere()), sleep=False), 8.0)
    assert len(moved) == 27
    assert max(moved.values()) < 0.002 * MM


@pytest.mark.slow
def test_parts_at_rest_do_not_drift_in_a_minute() -> None:
    parts = list(everywhere())
    bench = Bench(cell(*(part for k, part in enumerate(parts) if k % 3 == k // 3 % 3)), sleep=False)
    assert {part.type for part in bench.world.parts} == set(PART_TYPES)
    assert max(drift(bench, 60.0).values()) < 0.01 * MM


def test_parts_sink_less_than_tolerance() -> None:
    bench = Bench(cell(*everywhere()))
    bench.run(1.0)
    for part in bench.world.parts:
        # the start is 0.1 mm above rest; part4 lies down on its skew underside
        settled = part.start.position[2] - bench.position(part)[2]
        allowed = 0.3 * MM if part.type == "part4" else 0.11 * MM
        assert 0.09 * MM < settled < allowed, part.name


@pytest.mark.slow
@pytest.mark.parametrize("kind", PART_TYPES)
def test_part_at_rest_stands_on_its_bounding_box(kind: str) -> None:
    bench = Bench(cell(part_on(kind, 1.21, 0.0, BELT_SURFACE)))
    bench.run(0.5)
    part = bench.world.parts[0]
    assert bench.position(part)[2] + part_type(kind).bottom == pytest.approx(BELT_SURFACE, abs=0.2 * MM)
