"""Heights and walls of the furniture, measured with rays as a sensor would."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.furniture import add_conveyor
from cellwright.cell.model.shelf import SHELF_SURFACE
from cellwright.engine.shapes import Visuals
from cellwright.util.pose import Pose, Vector3
from tests.cell.model.bench import Bench, cell
from tests.support.places import BELT, BELT_SURFACE, BIN_CENTRES, BIN_SURFACE, LAYOUT, TRAY_SURFACE

SOLID = np.array([0, 1, 0, 1, 0, 0], dtype=np.uint8)


@pytest.fixture(scope="module")
def bench() -> Bench:
    bench = Bench(cell())
    mujoco.mj_forward(bench.model, bench.data)
    return bench


def cast_ray(bench: Bench, start: Vector3, direction: Vector3) -> float:
    """Return the distance [m] to the first hit of a ray; -1 without a hit."""
    hit = np.zeros(1, dtype=np.int32)
    origin, ray = np.array(start, dtype=float), np.array(direction, dtype=float)
    return float(mujoco.mj_ray(bench.model, bench.data, origin, ray, SOLID, 1, -1, hit))


def height(bench: Bench, x: float, y: float, start: float = 1.9) -> float:
    return start - cast_ray(bench, (x, y, start), (0.0, 0.0, -1.0))


@pytest.mark.parametrize("name", BIN_CENTRES)
def test_bins_have_original_floor_and_walls(bench: Bench, name: str) -> None:
    x, y = BIN_CENTRES[name]
    for dx, dy in ((0.0, 0.0), (0.29, 0.29), (-0.29, 0.2)):
        assert height(bench, x + dx, y + dy) == pytest.approx(BIN_SURFACE)
    inside = BIN_SURFACE + 0.03
    for side in (1.0, -1.0):
        # walls across y over the whole length; across x only in the corners, open in the middle
        assert cast_ray(bench, (x + 0.1, y, inside), (0.0, side, 0.0)) == pytest.approx(0.3175, abs=1e-4)
        assert cast_ray(bench, (x, y + 0.25, inside), (side, 0.0, 0.0)) == pytest.approx(0.3175, abs=1e-4)
        assert not 0.0 <= cast_ray(bench, (x, y + 0.1, inside), (side, 0.0, 0.0)) < 0.4
        assert height(bench, x, y + 0.3215 * side) == pytest.approx(0.79089, abs=1e-4)
        assert height(bench, x + 0.3215 * side, y + 0.25) == pytest.approx(0.79089, abs=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_trays_have_original_surface_and_rim(bench: Bench, side: float) -> None:
    x, y = 0.3, 3.15 * side
    assert height(bench, x, y) == pytest.approx(TRAY_SURFACE, abs=1e-6)
    assert height(bench, x + 0.24, y + 0.34) == pytest.approx(TRAY_SURFACE, abs=1e-6)
    assert cast_ray(bench, (x, y, 0.77), (1.0, 0.0, 0.0)) == pytest.approx(0.2495, abs=4e-3)
    assert cast_ray(bench, (x + 0.15, y, 0.77), (0.0, 1.0, 0.0)) == pytest.approx(0.3495, abs=4e-3)
    assert height(bench, x + 0.2529, y) == pytest.approx(0.7754, abs=1e-4)


def test_belt_has_original_surface_and_ends(bench: Bench) -> None:
    assert pytest.approx(0.90691) == BELT_SURFACE
    for y in (10.2, 5.0, -4.2):
        assert height(bench, 1.21, y) == pytest.approx(BELT_SURFACE, abs=1e-6)
    assert height(bench, 0.89, 1.3) == pytest.approx(BELT_SURFACE, abs=1e-6)
    assert height(bench, 0.87, 1.3) == pytest.approx(0.0, abs=1e-6)  # beside it; visual shapes do not count
    assert height(bench, 1.21, -4.4) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("place", [(0.0, 2.0), (30.0, -30.0), (-16.5, -3.0), (40.0, 40.0)])
def test_floor_is_everywhere(bench: Bench, place: tuple[float, float]) -> None:
    assert height(bench, *place) == pytest.approx(0.0, abs=1e-9)


def test_shelf_has_its_surface(bench: Bench) -> None:
    assert height(bench, *LAYOUT.shelf.position[:2]) == pytest.approx(SHELF_SURFACE)


def test_workcell_frames_are_solid_at_original_positions(bench: Bench) -> None:
    assert height(bench, -0.31, 0.0, 2.5) == pytest.approx(2.025)
    assert height(bench, 1.21, 0.5, 3.5) == pytest.approx(3.025)
    assert cast_ray(bench, (1.4, 2.0, 1.5), (1.0, 0.0, 0.0)) == pytest.approx(0.275 + 0.0016, abs=1e-4)
    for y, x in ((1.5, -0.3131), (-2.0, -0.3159)):  # positions of the original's posts
        assert cast_ray(bench, (0.0, y, 1.5), (-1.0, 0.0, 0.0)) == pytest.approx(-x - 0.025, abs=1e-4)


def test_deletion_wall_does_not_stop_rays(bench: Bench) -> None:
    assert cast_ray(bench, (1.2, 0.0, 1.4), (0.0, -1.0, 0.0)) == -1.0


@pytest.mark.parametrize("length", [0.5, 1.0, 4.5, 6.0, 14.62206, 30.0])
@pytest.mark.parametrize("surface", [0.3, 0.90691])
def test_legs_of_a_belt_stand_on_the_floor_under_it(length: float, surface: float) -> None:
    centre = Pose((1.0, 2.0, surface - 0.09431))
    belt = replace(BELT, centre=centre, size=(length, 0.65461, 0.18862))
    visuals = Visuals()
    add_conveyor(mujoco.MjSpec(), visuals, belt)
    legs = [shape for _, shape in visuals.shapes if shape.size[:2] == (0.03, 0.03)]
    assert len(legs) >= 6
    for leg in legs:
        x, _, z = leg.pose.position
        assert abs(x) + 0.03 <= length / 2
        assert (centre @ leg.pose).position[2] == pytest.approx(leg.size[2], abs=1e-4)
        assert z + leg.size[2] < 0.0
