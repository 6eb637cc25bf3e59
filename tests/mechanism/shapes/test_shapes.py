"""Shapes of links in the engine: kinds and sizes, meshes, and contacts."""

import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest

from cellwright.config.models.model import ModelShape
from cellwright.mechanism.shapes import DEFAULT_COLOUR, FLOOR, MIN_HALF_LENGTH
from cellwright.robot.model import build_robot
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose, Vector3
from tests.cell.model.robots import one_link
from tests.config.models.dae_files import RED, two_colours

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)]
OUTWARD = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def write_stl(path: Path, triangles: list[tuple[int, int, int]]) -> Path:
    facets = [struct.pack("<12fH", 0, 0, 0, *(x for k in each for x in CORNERS[k]), 0) for each in triangles]
    path.write_bytes(bytes(80) + struct.pack("<I", len(facets)) + b"".join(facets))
    return path


def built(*shapes: ModelShape, self_collision: bool = False) -> tuple[mujoco.MjModel, list[int]]:
    """Return the model, and the geoms that are not the floor."""
    model = build_robot(one_link(*shapes), self_collision=self_collision).model
    return model, [geom for geom in range(model.ngeom) if geom != model.geom(FLOOR).id]


@pytest.mark.parametrize(
    ("kind", "size", "half"),
    [
        ("box", (1.0, 2.0, 3.0), [0.5, 1.0, 1.5]),
        ("sphere", (0.5, 0.0, 0.0), [0.5, 0.0, 0.0]),
        ("cylinder", (0.5, 2.0, 0.0), [0.5, 1.0, 0.0]),
        ("capsule", (0.5, 2.0, 0.0), [0.5, 1.0, 0.0]),
        ("box", (1.0, 2.0, 1e-9), [0.5, 1.0, MIN_HALF_LENGTH]),
    ],
)
def test_primitive_shape_becomes_geom_of_its_size(kind: str, size: Vector3, half: list[float]) -> None:
    model, (geom,) = built(ModelShape(kind, size, Pose((1.0, 2.0, 3.0))))  # type: ignore[arg-type]
    assert model.geom(geom).size == pytest.approx(half, abs=MIN_HALF_LENGTH)
    assert model.geom(geom).pos.tolist() == [1.0, 2.0, 3.0]
    assert model.geom(geom).rgba == pytest.approx(DEFAULT_COLOUR)
    assert model.body("stone").mass[0] == 1.0  # shapes have no mass


def test_collision_shapes_are_left_out_without_self_collision() -> None:
    touched = ModelShape("box", (1.0, 1.0, 1.0), is_seen=False)
    seen = ModelShape("box", (2.0, 1.0, 1.0), is_touched=False, colour=(1.0, 0.0, 0.0, 1.0))
    model, (geom,) = built(touched, seen)
    assert model.geom(geom).size[0] == 1.0
    assert model.geom(geom).rgba.tolist() == [1.0, 0.0, 0.0, 1.0]
    assert model.geom(geom).contype[0] == 0
    model, geoms = built(touched, seen, self_collision=True)
    assert sorted((model.geom(geom).contype[0], model.geom(geom).group[0]) for geom in geoms) == [(0, 2), (1, 3)]


@pytest.mark.parametrize("self_collision", [False, True])
def test_stepping_model_lacks_what_is_only_seen(tmp_path: Path, *, self_collision: bool) -> None:
    path = write_stl(tmp_path / "a.stl", OUTWARD)
    both = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=path)
    seen = ModelShape("mesh", (2.0, 1.0, 1.0), is_touched=False, mesh=path)
    world = build_robot(one_link(both, seen), self_collision=self_collision)
    whole, stepping = world.model, world.stepping
    assert (whole.ngeom, whole.nmesh) == (3, 2)  # with the floor
    assert (stepping.ngeom, stepping.nmesh) == ((1, 1) if self_collision else (0, 0))
    for field in ("nbody", "nq", "nv", "nu", "nmocap"):
        assert getattr(stepping, field) == getattr(whole, field), field
    for field in ("body_mass", "body_inertia", "body_pos", "qpos0", "jnt_axis"):
        assert (getattr(stepping, field) == getattr(whole, field)).all(), field
    assert [stepping.body(body).name for body in range(stepping.nbody)] == [
        whole.body(body).name for body in range(whole.nbody)
    ]


def test_mesh_is_drawn_in_the_colours_of_its_file_and_touched_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.dae"
    path.write_text(two_colours())
    grey = (0.5, 0.5, 0.5, 1.0)
    model, geoms = built(ModelShape("mesh", (1.0, 1.0, 2.0), colour=grey, mesh=path), self_collision=True)
    found = [(model.geom(geom).group[0], model.geom(geom).contype[0]) for geom in geoms]
    assert found == [(2, 0), (2, 0), (3, 1)]
    assert [tuple(model.geom(geom).rgba) for geom in geoms] == [RED, (0.0, 0.0, 1.0, 1.0), grey]
    assert np.ptp(world_corners(model, geoms[2]), axis=0) == pytest.approx([1.0, 1.0, 2.0])
    model, geoms = built(ModelShape("mesh", (1.0, 1.0, 2.0), colour=grey, mesh=path))
    assert [tuple(model.geom(geom).rgba) for geom in geoms] == [RED, (0.0, 0.0, 1.0, 1.0)]


def world_corners(model: mujoco.MjModel, geom: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return the vertices of a mesh in the engine."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mesh = model.geom(geom).dataid[0]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    local = model.mesh_vert[first : first + count]
    found: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = (
        local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    )
    return found


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (0.001, 0.001, 0.002), (1.0, -1.0, 1.0)])
def test_mesh_vertices_keep_scaled_pose(tmp_path: Path, scale: Vector3) -> None:
    path = write_stl(tmp_path / "a.stl", OUTWARD)
    place = Pose.from_rpy((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    model, (geom,) = built(ModelShape("mesh", scale, place, mesh=path))
    x, y, z = scale
    expected = [place.transform((x * a, y * b, z * c)) for a, b, c in CORNERS]
    found = world_corners(model, geom)
    assert np.array(sorted(map(tuple, found.round(6)))) == pytest.approx(np.array(sorted(expected)), abs=1e-5)


def test_mirrored_mesh_keeps_its_outside(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "a.stl", OUTWARD)
    for scale in ((1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (-1.0, -1.0, -1.0)):
        model, (geom,) = built(ModelShape("mesh", scale, mesh=path))
        mesh = model.geom(geom).dataid[0]
        vertices = model.mesh_vert[: model.mesh_vertnum[mesh]].astype(float)
        a, b, c = (vertices[model.mesh_face[:, corner]] for corner in range(3))
        enclosed = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        assert enclosed == pytest.approx(1.0), scale


def test_mesh_of_several_shapes_is_loaded_once(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "a.stl", OUTWARD)
    shape = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=path)
    other = ModelShape("mesh", (2.0, 1.0, 1.0), mesh=path)
    assert built(shape, shape, other)[0].nmesh == 2


def test_flat_collision_mesh_becomes_box(tmp_path: Path) -> None:
    path = tmp_path / "flat.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4\n")
    shape = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=path)
    assert built(shape)[0].nmesh == 1
    model, (geom,) = built(shape, self_collision=True)
    assert model.geom(geom).type[0] == mujoco.mjtGeom.mjGEOM_BOX
    assert model.geom(geom).size == pytest.approx([0.5, 1.0, MIN_HALF_LENGTH])
    assert model.geom(geom).pos.tolist() == [0.5, 1.0, 0.0]


def test_single_triangle_becomes_box(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "flat.stl", OUTWARD[:1])
    model, (geom,) = built(ModelShape("mesh", (1.0, 1.0, 1.0), mesh=path))
    assert model.geom(geom).type[0] == mujoco.mjtGeom.mjGEOM_BOX


def test_missing_mesh_is_reported_in_one_line(tmp_path: Path) -> None:
    shape = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=tmp_path / "gone.stl")
    with pytest.raises(
        DescriptionError, match=r"^stone.urdf: the engine cannot build .*gone.stl: there is no such file$"
    ):
        built(shape)
