from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.devices.sensors.rays import SOLID_GROUPS, Rays, fan
from cellwright.errors import UsageError
from cellwright.pose import Pose
from tests.devices.sensors.scene import DRAWN_ONLY, add_block, empty_spec, make_simulation

AHEAD = [(1.0, 0.0, 0.0)]


@pytest.mark.parametrize("group", range(6))
def test_rays_see_what_is_solid(group: int) -> None:
    spec = empty_spec()
    add_block(spec, (0.5, 0.0, 0.0), (0.1, 0.1, 0.1), group=group)
    found = Rays(Pose(), AHEAD, farthest=1.0).cast(make_simulation(spec))
    assert found[0] == (pytest.approx(0.4, abs=1e-12) if group in SOLID_GROUPS else math.inf)


def test_a_housing_around_the_source_hides_nothing() -> None:
    spec = empty_spec()
    add_block(spec, (0.0, 0.0, 0.0), (0.05, 0.05, 0.05), group=DRAWN_ONLY)
    add_block(spec, (0.5, 0.0, 0.0), (0.1, 0.1, 0.1))
    assert Rays(Pose(), AHEAD, farthest=1.0).cast(make_simulation(spec))[0] == pytest.approx(0.4, abs=1e-12)


@given(
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.floats(0.05, 2.0),
)
def test_distance_to_a_wall_is_exact_in_any_pose(
    xyz: tuple[float, float, float], rpy: tuple[float, float, float], distance: float
) -> None:
    """The wall stands in the sensor's own frame, so the true distance is known wherever the sensor is."""
    pose = Pose.from_rpy(xyz, rpy)
    wall = pose @ Pose((distance + 0.1, 0.0, 0.0))
    spec = empty_spec()
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=wall.position, quat=wall.quaternion, size=[0.1, 3, 3], group=3
    )
    simulation = make_simulation(spec)
    angles = np.linspace(-0.3, 0.3, 7)
    directions = fan(angles, angles)
    found = Rays(pose, directions, farthest=5.0).cast(simulation)
    # the engine takes a rotation of less than 1e-7 for none
    assert found == pytest.approx([distance / direction[0] for direction in directions], abs=1e-7)


def test_rays_end_where_they_end() -> None:
    spec = empty_spec()
    add_block(spec, (1.1, 0.0, 0.0), (0.1, 0.1, 0.1))
    simulation = make_simulation(spec)
    assert Rays(Pose(), AHEAD, farthest=0.999).cast(simulation)[0] == math.inf
    assert Rays(Pose(), AHEAD, farthest=1.001).cast(simulation)[0] == pytest.approx(1.0, abs=1e-12)


def test_what_is_nearer_than_the_beginning_is_passed_over() -> None:
    spec = empty_spec()
    add_block(spec, (0.1, 0.0, 0.0), (0.05, 0.01, 0.01))
    add_block(spec, (0.6, 0.0, 0.0), (0.1, 0.1, 0.1))
    simulation = make_simulation(spec)
    assert Rays(Pose(), AHEAD, nearest=0.2, farthest=1.0).cast(simulation)[0] == pytest.approx(0.5, abs=1e-12)
    assert Rays(Pose(), AHEAD, nearest=0.2, farthest=0.45).cast(simulation)[0] == math.inf
    # a ray that begins within the first block leaves it at its far side
    assert Rays(Pose(), AHEAD, nearest=0.1, farthest=1.0).cast(simulation)[0] == pytest.approx(0.15, abs=1e-12)


def test_one_bundle_finds_what_single_rays_find() -> None:
    spec = empty_spec()
    generator = np.random.default_rng(5)
    for _ in range(60):
        x, y, z = generator.uniform((0.5, -1, -1), (2.5, 1, 1)).tolist()
        add_block(spec, (x, y, z), (0.05, 0.05, 0.05))
    simulation = make_simulation(spec)
    angles = np.linspace(-0.5, 0.5, 15)
    directions = fan(angles, angles)
    together = Rays(Pose(), directions, farthest=3.0).cast(simulation)
    single = [Rays(Pose(), [direction], farthest=3.0).cast(simulation)[0] for direction in directions]
    assert together.tolist() == single
    assert 20 < np.isfinite(together).sum() < 225


def test_a_fan_turns_towards_y_and_z() -> None:
    left_up = fan(np.array([0.1]), np.array([0.2]))[0]
    assert left_up[1] > 0
    assert left_up[2] == pytest.approx(math.sin(0.2))
    directions = np.array(fan(np.linspace(-0.1, 0.1, 3), np.linspace(-0.2, 0.2, 2)))
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    assert (np.diff(directions[:3, 1]) > 0).all()  # horizontal angles run fastest


def test_rays_that_end_before_they_begin_are_refused() -> None:
    with pytest.raises(UsageError, match="must end behind"):
        Rays(Pose(), AHEAD, nearest=1.0, farthest=0.5)
