from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.range_sensors import SOLID_GROUPS, Rays, ray_fan
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose
from tests.cell.devices.scene import CYLINDER, DRAWN_ONLY, add_block, add_part, empty_spec, make_simulation

AHEAD = [(1.0, 0.0, 0.0)]


@pytest.mark.parametrize("group", range(6))
def test_rays_detect_solid_groups_only(group: int) -> None:
    spec = empty_spec()
    add_block(spec, (0.5, 0.0, 0.0), (0.1, 0.1, 0.1), group=group)
    found = Rays(Pose(), AHEAD, farthest=1.0).cast(make_simulation(spec))
    assert found[0] == (pytest.approx(0.4, abs=1e-12) if group in SOLID_GROUPS else math.inf)


def test_housing_around_source_occludes_nothing() -> None:
    spec = empty_spec()
    add_block(spec, (0.0, 0.0, 0.0), (0.05, 0.05, 0.05), group=DRAWN_ONLY)
    add_block(spec, (0.5, 0.0, 0.0), (0.1, 0.1, 0.1))
    assert Rays(Pose(), AHEAD, farthest=1.0).cast(make_simulation(spec))[0] == pytest.approx(0.4, abs=1e-12)


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(*[st.floats(-3, 3)] * 3), st.floats(0.05, 2.0))
def test_distance_to_wall_is_exact_in_any_pose(
    xyz: tuple[float, float, float], rpy: tuple[float, float, float], distance: float
) -> None:
    """The wall stands in the sensor's own frame, so the true distance is known for any sensor pose."""
    pose = Pose.from_rpy(xyz, rpy)
    wall = pose @ Pose((distance + 0.1, 0.0, 0.0))
    spec = empty_spec()
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=wall.position, quat=wall.quaternion, size=[0.1, 3, 3], group=3
    )
    simulation = make_simulation(spec)
    angles = np.linspace(-0.3, 0.3, 7)
    directions = ray_fan(angles, angles)
    found = Rays(pose, directions, farthest=5.0).cast(simulation)
    # the engine treats a rotation of less than 1e-7 as none
    assert found == pytest.approx([distance / direction[0] for direction in directions], abs=1e-7)


def test_object_beyond_farthest_is_not_detected() -> None:
    spec = empty_spec()
    add_block(spec, (1.1, 0.0, 0.0), (0.1, 0.1, 0.1))
    simulation = make_simulation(spec)
    assert Rays(Pose(), AHEAD, farthest=0.999).cast(simulation)[0] == math.inf
    assert Rays(Pose(), AHEAD, farthest=1.001).cast(simulation)[0] == pytest.approx(1.0, abs=1e-12)


def test_object_before_nearest_is_ignored() -> None:
    spec = empty_spec()
    add_block(spec, (0.1, 0.0, 0.0), (0.05, 0.01, 0.01))
    add_block(spec, (0.6, 0.0, 0.0), (0.1, 0.1, 0.1))
    simulation = make_simulation(spec)
    assert Rays(Pose(), AHEAD, nearest=0.2, farthest=1.0).cast(simulation)[0] == pytest.approx(0.5, abs=1e-12)
    assert Rays(Pose(), AHEAD, nearest=0.2, farthest=0.45).cast(simulation)[0] == math.inf
    # a ray that begins within the first block leaves it at its far side
    assert Rays(Pose(), AHEAD, nearest=0.1, farthest=1.0).cast(simulation)[0] == pytest.approx(0.15, abs=1e-12)


def test_bundle_equals_single_rays() -> None:
    spec = empty_spec()
    generator = np.random.default_rng(5)
    for _ in range(60):
        x, y, z = generator.uniform((0.5, -1, -1), (2.5, 1, 1)).tolist()
        add_block(spec, (x, y, z), (0.05, 0.05, 0.05))
    simulation = make_simulation(spec)
    angles = np.linspace(-0.5, 0.5, 15)
    directions = ray_fan(angles, angles)
    together = Rays(Pose(), directions, farthest=3.0).cast(simulation)
    single = [Rays(Pose(), [direction], farthest=3.0).cast(simulation)[0] for direction in directions]
    assert together.tolist() == single
    assert 20 < np.isfinite(together).sum() < 225


def test_ray_fan_turns_towards_y_and_z() -> None:
    left_up = ray_fan(np.array([0.1]), np.array([0.2]))[0]
    assert left_up[1] > 0
    assert left_up[2] == pytest.approx(math.sin(0.2))
    directions = np.array(ray_fan(np.linspace(-0.1, 0.1, 3), np.linspace(-0.2, 0.2, 2)))
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    assert (np.diff(directions[:3, 1]) > 0).all()  # horizontal angles vary fastest


def cast_plainly(
    rays: Rays, pose: Pose, directions: list[tuple[float, float, float]], simulation: Simulation
) -> list[float]:
    """Return the engine's result for each single ray among fixed and movable bodies."""
    groups = np.array([group in SOLID_GROUPS for group in range(6)], dtype=np.uint8)
    found = []
    for direction in directions:
        ahead = np.array(pose.rotate(direction))
        reached = -1.0
        for begin in (0.0, rays.nearest):
            start = np.array(pose.position) + begin * ahead
            hit = mujoco.mj_ray(simulation.model, simulation.data, start, ahead, groups, True, -1, None)
            reached = begin + hit if hit >= 0.0 else math.inf
            if reached >= rays.nearest:
                break
        found.append(reached if reached <= rays.farthest else math.inf)
    return found


PLACES = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@pytest.mark.slow
@given(
    fixed=st.lists(PLACES, max_size=4),
    movable=st.lists(st.tuples(PLACES, PLACES), min_size=1, max_size=6),
    moved=st.lists(PLACES, min_size=6, max_size=6),
    source=st.tuples(PLACES, PLACES),
    nearest=st.floats(0.0, 0.3),
    farthest=st.floats(0.4, 2.0),
)
def test_bundle_detects_moving_among_fixed_geoms(
    fixed: list[tuple[float, float, float]],
    movable: list[tuple[tuple[float, float, float], tuple[float, float, float]]],
    moved: list[tuple[float, float, float]],
    source: tuple[tuple[float, float, float], tuple[float, float, float]],
    nearest: float,
    farthest: float,
) -> None:
    """A bundle equals single rays against the whole scene, even after things have moved."""
    spec = empty_spec()
    for centre in fixed:
        add_block(spec, centre, (0.1, 0.2, 0.05))
    for number, (xyz, rpy) in enumerate(movable):
        shape = CYLINDER if number % 2 else mujoco.mjtGeom.mjGEOM_BOX
        add_part(spec, f"part_{number}", Pose.from_rpy(xyz, rpy), (0.1, 0.05, 0.02), shape, (0.0, 0.05, 0.0))
    simulation = make_simulation(spec)
    pose = Pose.from_rpy(*source)
    directions = ray_fan(np.linspace(-0.6, 0.6, 9), np.linspace(-0.2, 0.2, 3))
    rays = Rays(pose, directions, nearest=nearest, farthest=farthest)
    assert rays.cast(simulation).tolist() == cast_plainly(rays, pose, directions, simulation)
    assert rays.first(simulation) == rays.cast(simulation)[0]
    for number in range(len(movable)):
        simulation.data.qpos[7 * number : 7 * number + 3] = moved[number]
    simulation.touch()
    simulation.refresh()
    assert rays.cast(simulation).tolist() == cast_plainly(rays, pose, directions, simulation)
    assert rays.first(simulation) == rays.cast(simulation)[0]


def test_only_rays_near_moving_geoms_are_cast_again(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = empty_spec()
    add_block(spec, (1.0, 0.0, 0.0), (0.1, 1.0, 1.0))
    add_part(spec, "part", Pose((0.0, 0.0, 5.0)), (0.02, 0.02, 0.02))
    simulation = make_simulation(spec)
    rays = Rays(Pose(), ray_fan(np.linspace(-0.5, 0.5, 101), np.zeros(1)), farthest=2.0)
    counts: list[int] = []
    engine = mujoco.mj_multiRay

    def counting(*arguments: object) -> None:
        counts.append(int(str(arguments[-2])))
        engine(*arguments)

    monkeypatch.setattr(mujoco, "mj_multiRay", counting)
    assert rays.cast(simulation).min() == pytest.approx(0.9)
    assert rays.cast(simulation).min() == pytest.approx(0.9)
    assert counts == [101]
    simulation.data.qpos[:3] = (0.5, 0.1, 0.0)
    simulation.touch()
    simulation.refresh()
    assert rays.cast(simulation).min() == pytest.approx(math.hypot(0.48, 0.48 * 0.08 / 0.48), abs=0.01)
    assert 5 < counts[1] < 25
