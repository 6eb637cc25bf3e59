"""Catalogue of parts: figures of the competition's models, and the engine's results for them."""

import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from cellwright.cell.model.parts import KNOWN_TYPES, PART_TYPES, add_part, add_part_meshes, part_type
from cellwright.config import footprints
from cellwright.engine.shapes import Visuals, bounds
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose

MASSES = {
    "gear_part": 0.5,
    "disk_part": 0.5,
    "gasket_part": 0.5,
    "piston_rod_part": 0.5,
    "pulley_part": 0.5,
    "part1": 1.0,
    "part2": 1.0,
    "part3": 1.0,
    "part4": 1.0,
}

TOPS = {
    "gear_part": 0.015,
    "disk_part": 0.026,
    "gasket_part": 0.025,
    "piston_rod_part": 0.0075,
    "pulley_part": 0.0724,
    "part1": 0.0075,
    "part2": 0.01,
    "part3": 0.02,
}


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    for kind in PART_TYPES:
        add_part(spec, Visuals(), kind, part_type(kind), Pose())
    return spec.compile()


def test_catalogue_has_all_described_part_types() -> None:
    assert set(PART_TYPES) == set(footprints.PART_TYPES) == set(MASSES)
    assert set(PART_TYPES) <= set(KNOWN_TYPES)


@pytest.mark.parametrize(("kind", "mass"), MASSES.items())
def test_part_type_has_original_mass(model: mujoco.MjModel, kind: str, mass: float) -> None:
    assert part_type(kind).mass == mass
    assert model.body(kind).mass[0] == pytest.approx(mass)
    assert model.body(kind).subtreemass[0] == pytest.approx(mass)


@pytest.mark.parametrize(("kind", "top"), TOPS.items())
def test_part_type_has_original_height(kind: str, top: float) -> None:
    assert part_type(kind).top == pytest.approx(top, abs=1e-9)


def half_extents(kind: str) -> npt.NDArray[np.float64]:
    lower, upper = part_type(kind).box
    return (np.array(upper) - lower) / 2


def test_part_types_have_original_bounding_boxes() -> None:
    assert half_extents("gear_part")[:2] == pytest.approx((0.0392, 0.0392))
    assert part_type("gear_part").bottom == pytest.approx(-0.0001)
    assert 2 * half_extents("gasket_part")[:2] == pytest.approx((0.188, 0.086), abs=1.5e-3)
    assert half_extents("pulley_part") == pytest.approx((0.1125, 0.1125, 0.0362))
    lower, upper = part_type("piston_rod_part").box
    assert lower == pytest.approx((-0.0295, -0.026, 0.0))
    assert upper == pytest.approx((0.0295, 0.135, 0.0075))
    assert part_type("part4").bottom == pytest.approx(-0.005, abs=2e-4)


def test_piston_rod_has_centre_of_mass_of_original(model: mujoco.MjModel) -> None:
    assert model.body("piston_rod_part").ipos == pytest.approx((0.0, 0.054, 0.00375), abs=5e-5)


@pytest.mark.parametrize("kind", PART_TYPES)
def test_inertia_fits_mass_and_size(model: mujoco.MjModel, kind: str) -> None:
    """No moment of inertia exceeds that of the mass at the corner of the bounding box, and A + B >= C."""
    a, b, c = sorted(float(value) for value in model.body(kind).inertia)
    assert a > 0
    assert a + b >= c * (1 - 1e-9)
    assert c <= part_type(kind).mass * float(np.square(half_extents(kind)).sum())


@pytest.mark.parametrize("kind", PART_TYPES)
def test_visual_shapes_stay_close_to_collision_shapes(kind: str) -> None:
    """Visual shapes neither float beside the collision shapes nor hide inside them."""
    lower, upper = part_type(kind).box
    visuals = Visuals()
    add_part_meshes(visuals)
    corners = [
        [shape.pose.transform(vertex) for vertex in visuals.meshes[shape.mesh][0].tolist()]
        if shape.kind == "mesh"
        else bounds((shape,))
        for shape in part_type(kind).seen or part_type(kind).solid
    ]
    seen = np.concatenate(corners)
    assert seen.min(axis=0) == pytest.approx(lower, abs=2.5e-3)
    assert seen.max(axis=0) == pytest.approx(upper, abs=2.5e-3)


def test_part_is_drawn_by_visuals_that_its_body_in_engine_lacks() -> None:
    spec, visuals = mujoco.MjSpec(), Visuals()
    add_part(spec, visuals, "gear", part_type("gear_part"), Pose())
    add_part(spec, visuals, "bar", part_type("part2"), Pose())
    model = spec.compile()
    assert [model.body(name).geomnum[0] for name in ("gear", "bar")] == [2, 1]
    assert [name for name, _ in visuals.shapes] == ["gear"] * 3  # the bar's collision shape is drawn
    assert tuple(shape for _, shape in visuals.shapes) == part_type("gear_part").seen


def test_marks_are_collision_shapes_without_mass() -> None:
    for kind in ("gear_part", "disk_part", "gasket_part"):
        solid = part_type(kind).solid
        assert solid[-1].share == 0.0
        assert solid[-1].pose.position[2] + solid[-1].half_extents[2] == pytest.approx(TOPS[kind])


def test_unknown_type_is_refused_with_suggestion() -> None:
    with pytest.raises(UnknownNameError, match="did you mean gear_part"):
        part_type("gears_part")
