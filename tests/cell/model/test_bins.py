"""Bins of any size, height and turn: measured with rays, and with parts thrown into them."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from cellwright.config.layout.layout import Bin, Side
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose
from tests.cell.model.bench import Bench
from tests.support.places import LAYOUT

SOLID = np.array([0, 1, 0, 1, 0, 0], dtype=np.uint8)
EDGES = (0.0, math.pi / 2, math.pi, -math.pi / 2)
TYPES = ("gear_part", "disk_part", "piston_rod_part", "gasket_part")


def own_bin(
    size: tuple[float, float], surface: float, *, turn: float = 0.0, walls: float = 0.06, opened: tuple[Side, ...] = ()
) -> Bin:
    """Return a bin away from all else."""
    pose = Pose.from_rpy((-4.0, 1.0, 0.0), (0.0, 0.0, turn))
    return Bin("own", pose, pose, size, surface, surface + 0.025, surface - 0.005, walls, opened)


def bench_of(each: Bin, *parts: Part) -> Bench:
    """Return a cell with one bin."""
    layout = replace(LAYOUT, bins=(each,))
    bench = Bench(Trial("bin", layout=layout, bin_parts=parts))
    mujoco.mj_forward(bench.model, bench.data)
    return bench


def ray(bench: Bench, each: Bin, start: tuple[float, float, float], ahead: tuple[float, float, float]) -> float:
    """Return the distance [m] to the first hit from a point of the bin's frame; -1 without a hit."""
    hit = np.zeros(1, dtype=np.int32)
    origin, direction = np.array(each.pose.transform(start)), np.array(each.pose.rotate(ahead))
    return float(mujoco.mj_ray(bench.model, bench.data, origin, direction, SOLID, 1, -1, hit))


@pytest.mark.parametrize("turn", [0.0, math.pi / 2, 0.5])
@pytest.mark.parametrize("link_turn", EDGES)
def test_bin_has_its_floor_and_its_walls_around_its_area(turn: float, link_turn: float) -> None:
    each = own_bin((0.9, 0.5), 0.6, turn=turn, opened=("+x",))
    each = replace(each, link=each.pose @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, link_turn)))
    bench = bench_of(each)
    for x, y in ((0.0, 0.0), (0.44, 0.24), (-0.44, -0.24)):
        assert ray(bench, each, (x, y, 1.0), (0.0, 0.0, -1.0)) == pytest.approx(0.4, abs=1e-6)
    for start, ahead, distance in (
        ((0.0, 0.0, 0.62), (-1.0, 0.0, 0.0), 0.45),
        ((0.0, 0.0, 0.62), (0.0, 1.0, 0.0), 0.25),
        ((0.0, 0.0, 0.62), (0.0, -1.0, 0.0), 0.25),
        ((0.0, 0.2, 0.62), (1.0, 0.0, 0.0), 0.45),
        ((0.0, -0.2, 0.62), (1.0, 0.0, 0.0), 0.45),
    ):
        assert ray(bench, each, start, ahead) == pytest.approx(distance, abs=1e-4)
    assert not 0.0 <= ray(bench, each, (0.0, 0.0, 0.62), (1.0, 0.0, 0.0)) < 0.7, "the open side"
    assert ray(bench, each, (-0.454, 0.0, 1.0), (0.0, 0.0, -1.0)) == pytest.approx(0.34, abs=1e-4), "upper edge"


def test_bin_without_walls_is_a_table() -> None:
    each = own_bin((0.6, 0.6), 0.7, walls=0.0)
    bench = bench_of(each)
    assert not 0.0 <= ray(bench, each, (0.0, 0.0, 0.71), (1.0, 0.0, 0.0)) < 0.7
    assert ray(bench, each, (0.299, 0.299, 1.0), (0.0, 0.0, -1.0)) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize(
    ("size", "surface"), [((0.5, 0.4), 0.1), ((0.6, 0.5), 0.725), ((1.6, 0.5), 0.3), ((2.2, 1.8), 1.3)]
)
@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_thrown_parts_stay_in_closed_bin(size: tuple[float, float], surface: float, turn: float) -> None:
    each = own_bin(size, surface, turn=turn, walls=0.12)
    places = [(x, y) for x in (-0.25, 0.25) for y in (-0.25, 0.25)]
    parts = [
        Part(f"own|{kind}_{n}", kind, each.pose @ Pose((x * size[0], y * size[1], surface + 0.06)))
        for n, (kind, (x, y)) in enumerate(zip(TYPES, places, strict=True))
    ]
    bench = bench_of(each, *parts)
    for n, part in enumerate(bench.parts.values()):
        angle = 2.5 * n
        speed = each.pose.rotate((0.8 * math.cos(angle), 0.8 * math.sin(angle), -1.5))
        bench.data.qvel[part.dof : part.dof + 3] = speed
    bench.run(4.0)
    for part in bench.parts.values():
        x, y, z = each.pose.inverse().transform(tuple(bench.position(part)))
        assert abs(x) < size[0] / 2, part.name
        assert abs(y) < size[1] / 2, part.name
        assert surface - 0.001 < z < surface + 0.1, part.name
        assert np.abs(bench.velocity(part)[:3]).max() < 0.01, part.name
