"""Top views of a part: its box, its heights, and the flat spots for the cup."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.cell.model.arm_looks import CUP_FACE_RADIUS
from cellwright.cell.model.own_models import form_of
from cellwright.cell.model.part_tops import CLEARANCE, PartTop, part_tops
from cellwright.config.models.model import ModelShape, UserModel
from cellwright.util.pose import Pose
from tests.support.own_parts import STEP_HEIGHT, write_step


def tops(*shapes: ModelShape, mass: float = 0.5) -> tuple[PartTop, ...]:
    return part_tops(form_of("my_part", UserModel(shapes, mass)))


def top(*shapes: ModelShape) -> PartTop:
    """Return the top of the part as modelled."""
    return tops(*shapes)[0]


def box(x: float, y: float, z: float, pose: Pose | None = None) -> ModelShape:
    """Return a box [m] that stands on the origin, or has its middle at `pose`."""
    return ModelShape("box", (x, y, z), Pose((0.0, 0.0, z / 2)) if pose is None else pose)


@settings(max_examples=30, deadline=None)
@given(
    st.floats(0.012, 0.2),
    st.floats(0.012, 0.2),
    st.floats(0.005, 0.2),
    st.floats(-3.1, 3.1),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
)
def test_box_has_spot_in_middle_of_its_top(
    x: float, y: float, z: float, yaw: float, aside: float, height: float
) -> None:
    found = top(box(x, y, z, Pose.from_rpy((aside, 0.0, height), (0.0, 0.0, yaw))))
    (spot,) = found.spots
    assert spot.position[:2] == pytest.approx((aside, 0.0), abs=0.004)  # cells of a millimetre
    assert spot.position[2] == pytest.approx(height + z / 2) == found.upper[2]
    assert found.lower[2] == pytest.approx(height - z / 2)
    assert spot.radius == pytest.approx(min(x / 2, y / 2, CUP_FACE_RADIUS), abs=0.002)
    assert found.radius == pytest.approx(math.hypot(x, y) / 2, abs=0.003)
    assert found.centre_of_mass == pytest.approx((aside, 0.0, height), abs=1e-6)


def test_cylinder_has_flat_top_only_upright() -> None:
    upright = ModelShape("cylinder", (0.035, 0.12, 0.0), Pose((0.0, 0.0, 0.06)))
    (spot,) = top(upright).spots
    assert spot.position == pytest.approx((0.0, 0.0, 0.12), abs=0.001)
    assert spot.radius == pytest.approx(0.035, abs=0.001)
    part_on = ModelShape("cylinder", (0.035, 0.12, 0.0), Pose.from_rpy((0.0, 0.0, 0.035), (0.0, math.pi / 2, 0.0)))
    assert all(spot.radius < 0.005 for spot in top(part_on).spots)


@pytest.mark.parametrize("shape", [ModelShape("sphere", (0.03, 0.0, 0.0)), ModelShape("capsule", (0.03, 0.05, 0.0))])
def test_round_top_has_no_flat_spot(shape: ModelShape) -> None:
    found = top(shape)
    assert all(spot.radius < 0.005 for spot in found.spots)
    assert found.upper[2] == pytest.approx(0.03 + (0.025 if shape.kind == "capsule" else 0.0))


def test_sloped_top_has_no_flat_spot() -> None:
    tilted = Pose.from_rpy((0.0, 0.0, 0.03), (0.15, 0.0, 0.0))
    assert top(box(0.08, 0.08, 0.02, tilted)).spots == ()


def test_flat_top_of_mesh_is_that_of_its_hull(tmp_path: Path) -> None:
    found, below, *_ = tops(
        ModelShape("mesh", (0.001,) * 3, Pose((0.0, 0.0, 0.01)), mesh=write_step(tmp_path / "step.obj"))
    )
    (spot,) = found.spots
    (base,) = below.spots
    assert base.position[2] == pytest.approx(-0.01)
    assert base.radius == pytest.approx(0.025, abs=0.002)
    assert spot.position[2] == pytest.approx(STEP_HEIGHT / 1000 + 0.01)
    assert 0.015 < spot.position[0] < 0.04  # the flat top is x 0 to 50 mm of -50 to 50
    assert spot.radius == pytest.approx(0.02, abs=0.005)
    assert found.centre_of_mass[0] > 0.005


def test_spot_keeps_clear_of_higher_shapes() -> None:
    plate, wall = box(0.3, 0.1, 0.01), box(0.008, 0.1, 0.05, Pose((-0.1, 0.0, 0.035)))
    found = top(plate, wall)
    by_height = {round(spot.position[2], 3): spot for spot in found.spots}
    assert by_height.keys() == {0.01, 0.06}
    assert by_height[0.06].radius == pytest.approx(0.004, abs=0.0015)
    assert by_height[0.01].position[0] >= -0.096 + CLEARANCE - 0.003
    assert found.spots[0] is by_height[0.01]


def test_hole_of_ring_is_no_spot() -> None:
    sides = [
        box(0.1, 0.03, 0.02, Pose((0.0, 0.035, 0.01))),
        box(0.1, 0.03, 0.02, Pose((0.0, -0.035, 0.01))),
        box(0.03, 0.1, 0.02, Pose((0.035, 0.0, 0.01))),
        box(0.03, 0.1, 0.02, Pose((-0.035, 0.0, 0.01))),
    ]
    (spot,) = top(*sides).spots
    assert max(abs(spot.position[0]), abs(spot.position[1])) > 0.02 + spot.radius - 0.002
    assert spot.radius >= 0.013
    assert np.isfinite(spot.position).all()


def test_part_tops_have_each_side_up() -> None:
    found = tops(box(0.1, 0.06, 0.03, Pose((0.0, 0.0, 0.0))))
    assert [round(each.upper[2], 6) for each in found] == [0.015, 0.015, 0.05, 0.05, 0.03, 0.03]
    ups = [Pose((0.0, 0.0, 0.0), each.turn).rotate((0.0, 0.0, 1.0)) for each in found]
    for up, axis in zip(ups, np.vstack([s * e for e in np.eye(3)[[2, 0, 1]] for s in (1, -1)]), strict=True):
        assert up == pytest.approx(tuple(axis), abs=1e-9)
    for each in found:
        (spot,) = each.spots
        assert spot.position == pytest.approx((0.0, 0.0, each.upper[2]), abs=0.002)
