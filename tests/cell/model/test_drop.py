"""Parts dropped from a metre land on top of what is below, in any orientation."""

from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.cell.model.parts import PART_TYPES
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose
from tests.cell.model.bench import Bench, at_step, cell
from tests.support.places import BELT_SURFACE, BIN_CENTRES, BIN_SURFACE, TRAY_SURFACE

# centre x, y, surface z, half width x, y of a surface that parts must not pass, and the depth that is solid
SOLIDS = np.array(
    [(x, y, BIN_SURFACE, 0.31, 0.31, 0.22) for x, y in BIN_CENTRES.values()]
    + [(0.3, 3.15 * side, TRAY_SURFACE, 0.245, 0.345, 0.08) for side in (1, -1)]
    + [(1.21, 3.0, BELT_SURFACE, 0.32, 7.3, 0.18)]
)
TRANSIENT = 0.02
"""Maximum depth [m] of a part's centre during an impact on the part's edge."""


def spots() -> list[tuple[str, float, float, float]]:
    """Return each type over a bin, over the belt and over a tray: type and the point below."""
    found: list[tuple[str, float, float, float]] = []
    for number, kind in enumerate(PART_TYPES):
        x, y = BIN_CENTRES[f"bin{number % 8 + 1}"]
        side, place = (1, number) if number < 5 else (-1, number - 5)
        found += [
            (kind, x, y + 0.25 * (number // 8), BIN_SURFACE),
            (kind, 1.21, -3.5 + 0.7 * number, BELT_SURFACE),
            (kind, 0.3 + (0.12, -0.12)[place % 2], 3.15 * side + 0.11 * (place - 2), TRAY_SURFACE),
        ]
    return found


SPOTS = spots()


def falling(**more: Any) -> Trial:
    return cell(*(Part(f"drop|{k}_{n}", k, Pose((x, y, z + 1.0))) for n, (k, x, y, z) in enumerate(SPOTS)), **more)


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench(falling())


def deepest(bench: Bench, centres: NDArray[np.float64]) -> float:
    """Return the maximum depth [m] of any part's centre inside a solid, including the floor."""
    shift = np.abs(centres[:, None, :2] - SOLIDS[None, :, :2])
    below = SOLIDS[None, :, 2] - centres[:, None, 2]
    inside = (shift < SOLIDS[None, :, 3:5]).all(axis=2) & (below > 0) & (below < SOLIDS[None, :, 5])
    return max(float(np.where(inside, below, 0.0).max()), float(-centres[:, 2].min()))


def drop(bench: Bench, seed: int) -> tuple[float, float]:
    """Drop everything in random orientations; return the worst depth [m] while falling, and at the end."""
    rng = np.random.default_rng(seed)
    mujoco.mj_resetData(bench.model, bench.data)
    bench.world.set_initial_posture(bench.data)
    for part, (_, x, y, z) in zip(bench.world.parts, SPOTS, strict=True):
        turn = rng.normal(size=4)
        bench.place(part, (x, y, z + 1.0), tuple(turn / np.linalg.norm(turn)))
    bodies = np.array([part.body for part in bench.world.parts])
    worst = depth = 0.0
    for _ in range(round(1.6 / bench.model.opt.timestep)):
        mujoco.mj_step(bench.model, bench.data)
        depth = deepest(bench, bench.data.xipos[bodies])
        worst = max(worst, depth)
    return worst, depth


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_dropped_parts_do_not_fall_through(bench: Bench, seed: int) -> None:
    worst, at_the_end = drop(bench, seed)
    assert worst < TRANSIENT
    assert at_the_end == 0.0


def test_dropped_parts_do_not_fall_through_at_long_timestep() -> None:
    worst, at_the_end = drop(Bench(falling(settings=at_step(1, 250))), 1)
    assert worst < 2 * TRANSIENT
    assert at_the_end == 0.0


def test_dropped_parts_are_not_flung_away(bench: Bench) -> None:
    """An impact at 4.4 m/s sends a part across the cell at most: no contact pushes harder than it was hit."""
    drop(bench, 3)
    for part in bench.world.parts:
        assert np.linalg.norm(bench.position(part)[:2] - np.array(part.start.position[:2])) < 3.0
