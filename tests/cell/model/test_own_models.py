"""User-defined models in the engine."""

from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.model.build import build_world
from cellwright.cell.model.own_models import form_of, model_problems
from cellwright.config.models.files import ModelFileError
from cellwright.config.models.model import ModelShape, UserModel
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Part, Trial
from cellwright.engine.shapes import Role
from cellwright.util.pose import Pose
from tests.config.models.dae_files import RED, two_colours

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "own_models"


@pytest.fixture(scope="module")
def cell() -> Cell:
    return Cell(load_trial([EXAMPLE / "own_models.yaml"]).trial)


def test_user_defined_parts_have_their_masses(cell: Cell) -> None:
    bodies = (*cell.world.parts, *cell.world.bodies)
    masses = {each.type: float(cell.simulation.model.body_mass[each.body]) for each in bodies}
    expected = {"bracket_part": 0.3, "wedge_part": 0.4, "valve_part": 0.6, "flange_part": 0.5, "knob_part": 0.21}
    assert masses == pytest.approx(expected)


def test_user_defined_parts_stay_where_placed(cell: Cell) -> None:
    cell.reset()
    for _ in range(1000):
        cell.step()
    surfaces = {"bin6": 0.725, "bin7": 0.725, "agv1": 0.755}
    for part in cell.parts.all:
        if not part.pooled:
            pose = cell.parts.pose(part)
            assert pose.position[:2] == pytest.approx(part.start.position[:2], abs=1e-3)
            assert pose.position[2] == pytest.approx(surfaces[part.name.partition("|")[0]], abs=1e-3)


def test_cameras_and_trays_report_user_defined_parts(cell: Cell) -> None:
    cell.reset()
    for _ in range(1000):
        cell.step()
    cell.simulation.refresh()
    seen = {name: sensor.read().detections for name, sensor in cell.sensors.items()}
    assert [each.type for each in seen["logical_camera_bin6"]] == ["bracket_part"] * 4
    assert "wedge_part" in [each.type for each in seen["logical_camera_agv1"]]
    assert [each.name for each in cell.trays[1].contents] == ["agv1|kit_tray_1|kit_tray_1|tray|wedge_part_1"]


def test_furniture_collides_at_its_pose(cell: Cell) -> None:
    model = cell.simulation.model
    body = model.body("furniture|shelf").id
    geom = int(model.body_geomadr[body])
    assert model.geom_contype[geom] == 1
    assert model.geom_group[geom] == Role.BOTH
    assert model.geom_size[geom] == pytest.approx((0.3, 0.15, 0.35))
    assert model.body_pos[body] == pytest.approx((-0.3, -2.2, 0))


def test_visual_shapes_do_not_collide(cell: Cell) -> None:
    model = cell.simulation.model
    body = model.body("bin7|valve_part_1").id
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    assert list(model.geom_group[first : first + count]) == [Role.SOLID] * 2
    seen = [shape for name, shape in cell.world.visuals.shapes if name == "bin7|valve_part_1"]
    assert [shape.kind for shape in seen] == ["cylinder"] * 2


@pytest.mark.parametrize("use", ["both", "seen", "touched"])
def test_mesh_goes_to_engine_or_visuals_by_its_use(use: str) -> None:
    cube = ModelShape("box", (0.1, 0.1, 0.1), is_seen=False)
    wedge = ModelShape(
        "mesh", (0.001,) * 3, is_touched=use != "seen", is_seen=use != "touched", mesh=EXAMPLE / "wedge.stl"
    )
    part = Part("bin7|my_part_1", "my_part", Pose((0, 0, 1)))
    world = build_world(Trial("t", bin_parts=(part,), part_models={"my_part": UserModel((wedge, cube), 1.0)}))
    name = "my_part|mesh_0"
    assert (name in world.visuals.meshes) == (use != "touched")
    assert (name in [world.model.mesh(mesh).name for mesh in range(world.model.nmesh)]) == (use != "seen")
    assert [shape.mesh for body, shape in world.visuals.shapes if body == part.name] == [name] * (use != "touched")


def test_mesh_is_drawn_in_the_colours_of_its_file_unless_the_part_gives_one(tmp_path: Path) -> None:
    (tmp_path / "a.dae").write_text(two_colours())
    mesh = ModelShape("mesh", (0.1, 0.1, 0.1), mesh=tmp_path / "a.dae")
    form = form_of("w", UserModel((mesh,), 1.0))
    assert [shape.half_extents for shape in form.touched] == [pytest.approx((0.05, 0.05, 0.05))]
    assert [shape.colour for shape in form.seen] == [RED, (0.0, 0.0, 1.0, 1.0)]
    assert [shape.pose.position[2] for shape in form.seen] == pytest.approx([0.0, 0.1])
    grey = (0.5, 0.5, 0.5, 1.0)
    form = form_of("w", UserModel((replace(mesh, colour=grey),), 1.0))
    assert form.seen == form.touched
    assert [shape.colour for shape in form.seen] == [grey]


def test_visual_mesh_without_surface_is_refused(tmp_path: Path) -> None:
    for name, content in (("point", "v 0 0 0\n" * 4), ("line", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 0 1\n")):
        (tmp_path / f"{name}.obj").write_text(content + "f 1 2 3\n")
        shapes = (ModelShape("mesh", (1.0, 1.0, 1.0), is_touched=False, mesh=tmp_path / f"{name}.obj"),)
        with pytest.raises(ModelFileError, match=r"obj: a mesh needs at least 4 vertices, and triangles with an area"):
            form_of("w", UserModel(shapes, 1.0))


def test_mesh_stands_where_file_places_it() -> None:
    form = form_of("w", load_trial([EXAMPLE / "own_models.yaml"]).trial.part_models["wedge_part"])
    (shape,) = form.touched
    assert shape.pose.position == pytest.approx((0, 0, 0.012))
    assert shape.half_extents == pytest.approx((0.03, 0.02, 0.012))


def test_mass_is_shared_by_volume() -> None:
    shapes = (ModelShape("box", (0.1, 0.1, 0.1)), ModelShape("box", (0.1, 0.1, 0.3)))
    assert [shape.share for shape in form_of("a", UserModel(shapes, 2.0)).touched] == pytest.approx([0.25, 0.75])


def test_all_shape_kinds_are_built() -> None:
    shapes = (
        ModelShape("box", (0.1, 0.1, 0.1)),
        ModelShape("sphere", (0.05, 0, 0)),
        ModelShape("cylinder", (0.05, 0.1, 0)),
        ModelShape("capsule", (0.05, 0.1, 0)),
    )
    part = Part("bin7|my_part_1", "my_part", Pose((0, 0, 1)))
    world = build_world(Trial("t", bin_parts=(part,), part_models={"my_part": UserModel(shapes, 1.0)}))
    (built,) = [each for each in world.parts if each.name == "bin7|my_part_1"]
    assert len(built.geoms) == 4
    assert built.shelf.position[2] == pytest.approx(0.5 + 0.1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("<mujoco><worldbody><geom type='bx' size='1'/></worldbody></mujoco>", "invalid keyword: 'bx'"),
        ("<mujoco/>", "no shapes; add a geom"),
        (
            "<mujoco><worldbody><body><joint/><geom size='.01'/></body></worldbody></mujoco>",
            "a model must be one rigid body",
        ),
        (
            "<mujoco><worldbody><geom type='plane' size='1 1 1'/></worldbody></mujoco>",
            "geom type plane is not supported",
        ),
        (
            "<mujoco><worldbody><body><geom size='.01' contype='0' conaffinity='0'/></body></worldbody></mujoco>",
            "no collision shapes",
        ),
        ("<mujoco><worldbody><geom size='.01'/></worldbody></mujoco>", "no mass; give one beside the file"),
        (
            "<mujoco><worldbody><body><geom size='.3'/></body></worldbody></mujoco>",
            "reaches 0.52 m from its origin; a part keeps within 0.22 m",
        ),
    ],
)
def test_file_that_engine_refuses_is_reported_with_path(content: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text(content)
    (tmp_path / "t.yaml").write_text("cellwright: {parts: {my_part: {file: a.xml}}}")
    trial = load_trial([tmp_path / "t.yaml"]).trial
    (found,) = model_problems(trial)
    assert found.startswith(f"{tmp_path / 'a.xml'}: ")
    assert message in found
    with pytest.raises(ModelFileError, match=r"a\.xml: "):
        build_world(trial)


def test_mjcf_mesh_keeps_scale_and_given_mass(tmp_path: Path) -> None:
    (tmp_path / "wedge.stl").write_bytes((EXAMPLE / "wedge.stl").read_bytes())
    (tmp_path / "a.xml").write_text(
        "<mujoco><asset><mesh name='w' file='wedge.stl' scale='.001 .001 .001'/></asset><worldbody>"
        "<body pos='1 2 3'><geom type='mesh' mesh='w' mass='0.3'/></body></worldbody></mujoco>"
    )
    (tmp_path / "t.yaml").write_text("cellwright: {parts: {my_part: {file: a.xml, mass: 0.4}}}")
    form = form_of("w", load_trial([tmp_path / "t.yaml"]).trial.part_models["my_part"])
    (shape,) = form.touched
    assert form.mass == 0.4
    vertices, triangles = form.meshes["w|mesh_0"]
    placed = [(shape.pose @ Pose(tuple(vertex))).position for vertex in vertices.tolist()]
    for axis, (lower, upper) in enumerate(((-0.03, 0.03), (-0.02, 0.02), (0, 0.024))):
        coordinates = [each[axis] for each in placed]
        assert (min(coordinates), max(coordinates)) == pytest.approx((lower, upper), abs=1e-6)
    assert len(triangles) == 8
