"""User-defined part types and furniture: entries that are read, and refused ones with their place."""

import struct
from pathlib import Path

import pytest

from cellwright.config.models import meshes
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import DescriptionError

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "own_models"


def load(folder: Path, text: str) -> Trial:
    path = folder / "trial.yaml"
    path.write_text(text)
    return load_trial([path]).trial


def read_errors(folder: Path, text: str) -> list[str]:
    """Return the errors, without the path of the YAML file."""
    with pytest.raises(DescriptionError) as raised:
        load(folder, text)
    return [str(problem).replace(f"{folder}/", "") for problem in raised.value.problems]


def parts(entry: str) -> str:
    return f"cellwright:\n  parts:\n    my_part: {entry}\n"


def test_own_models_example_is_read() -> None:
    trial = load_trial([EXAMPLE / "own_models.yaml"]).trial
    models = trial.part_models
    assert list(models) == ["bracket_part", "wedge_part", "valve_part", "flange_part", "knob_part"]
    assert [model.mass for model in models.values()] == [0.3, 0.4, 0.6, 0.5, None]
    box, peg = models["bracket_part"].shapes
    assert (box.kind, box.size, box.pose.position) == ("box", (0.08, 0.05, 0.008), (0, 0, 0.004))
    assert (peg.kind, peg.size, peg.colour) == ("cylinder", (0.015, 0.02, 0), (0.3, 0.3, 0.35, 1.0))
    (wedge,) = models["wedge_part"].shapes
    assert wedge.mesh == EXAMPLE / "wedge.stl"
    assert wedge.size == (0.001,) * 3
    assert [(s.is_touched, s.is_seen) for s in models["valve_part"].shapes] == [(True, False)] * 2 + [(False, True)] * 2
    assert models["valve_part"].shapes[2].colour == (0.7, 0.6, 0.3, 1.0)
    neck = models["flange_part"].shapes[2]
    assert neck.pose.position == pytest.approx((0, 0, 0.02))
    assert models["knob_part"].mjcf == EXAMPLE / "knob.xml"
    assert [piece.name for piece in trial.furniture] == ["shelf", "post"]
    assert len(trial.bin_parts) == 8
    assert [part.type for part in trial.belt_parts] == ["knob_part"]
    assert [part.name for part in trial.extra_parts] == ["agv1|kit_tray_1|kit_tray_1|tray|wedge_part_1"]


BOX = "{mass: 1, shapes: [{box: [0.1, 0.1, 0.1]}]}"


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{shapes: [{box: [0.1, 0.1, 0.1]}]}", "the required entry 'mass' [kg] is missing, and no model file has it"),
        ("{mass: 0, shapes: [{box: [0.1, 0.1, 0.1]}]}", "mass must be from 0.001 to 100 kg (got 0)"),
        ("{mass: .inf, shapes: [{box: [0.1, 0.1, 0.1]}]}", "must be a finite number"),
        ("{mass: 1}", "needs either 'shapes' or 'file'"),
        ("{mass: 1, shapes: [], file: a.sdf}", "needs either 'shapes' or 'file', not both"),
        ("{mass: 1, shapes: []}", "must be a list of 1 to 200 shapes (got a list of 0)"),
        ("{mas: 1, shapes: [{box: [0.1, 0.1, 0.1]}]}", "unknown entry; did you mean mass"),
        ("{mass: 1, shapes: [{bx: [0.1, 0.1, 0.1]}]}", "unknown entry; did you mean box"),
        (
            "{mass: 1, shapes: [{box: [0.1, 0.1, 0]}]}",
            "lengths of a box must be from 0.0001 to 20 m (got 0.1 x 0.1 x 0)",
        ),
        ("{mass: 1, shapes: [{box: [0.1, 0.1, .nan]}]}", "must be a finite number"),
        ("{mass: 1, shapes: [{box: [0.5, 0.1, 0.1]}]}", "must stay within 0.22 m of its origin (got 0.26 m)"),
        ("{mass: 1, shapes: [{sphere: {radius: 0.3}}]}", "within 0.22 m of its origin (got 0.30 m)"),
        ("{mass: 1, shapes: [{capsule: {radius: 0.01, length: 1}}]}", "within 0.22 m of its origin (got 0.51 m)"),
        ("{mass: 1, shapes: [{sphere: {radius: -1}}]}", "lengths of a sphere must be from 0.0001 to 20 m (got -1)"),
        ("{mass: 1, shapes: [{cylinder: {radius: 0.1}}]}", "the required entry 'length' is missing"),
        ("{mass: 1, shapes: [{box: [1, 1, 1], sphere: {radius: 1}}]}", "must have exactly one of box, cylinder, "),
        ("{mass: 1, shapes: [{box: [0.1, 0.1, 0.1], use: sen}]}", "unknown use 'sen'; did you mean seen"),
        ("{mass: 1, shapes: [{box: [0.1, 0.1, 0.1], use: seen}]}", "no collision shape"),
        (
            "{mass: 1, shapes: [{box: [0.1, 0.1, 0.1], color: [1, 2, 0]}]}",
            "must be [red, green, blue] or [red, green, blue, opacity]",
        ),
        ("{mass: 1, shapes: [{box: [0.1, 0.1, 0.1], scale: 2}]}", "only a mesh can have a scale"),
        (
            "{mass: 1, shapes: [{box: [0.1, 0.1, 0.1], pose: {xyz: [0, 0, sqr(2)]}}]}",
            "'sqr(2)' uses 'sqr', which is not in Python",
        ),
        ("{mass: 1, shapes: [{mesh: no.stl}]}", "no.stl: there is no such file"),
        ("{mass: 1, shapes: [{mesh: a.ply}]}", "a.ply: must be an .stl, .obj or .dae file; convert the mesh"),
        ("{file: nowhere}", "nowhere: there is no such file"),
        ("{file: 3}", "must be the path of a file (got the number 3)"),
        ("{file: trial.yaml}", "trial.yaml:1: invalid XML (column 1)"),
    ],
)
def test_invalid_part_is_refused(entry: str, message: str, tmp_path: Path) -> None:
    found = read_errors(tmp_path, parts(entry))
    assert all(each.startswith("trial.yaml:3: cellwright.parts.my_part") for each in found)
    assert message in found[0]


@pytest.mark.parametrize("name", ["gear_part", "agv1", "my_part_3", "a_clone_x", "my|part", "9part"])
def test_invalid_part_name_is_refused(name: str, tmp_path: Path) -> None:
    (found,) = read_errors(tmp_path, f"cellwright:\n  parts:\n    '{name}': {BOX}\n")
    assert "a part type must be" in found or "is in use" in found


def test_part_may_have_the_name_of_an_agv_that_the_cell_lacks(tmp_path: Path) -> None:
    part = f"cellwright:\n  parts:\n    agv1: {BOX}\n"
    (tmp_path / "trial.yaml").write_text(f"{part}cell: {{carriers: {{agv3: {{at: [0, 3]}}}}}}\n")
    assert [*load_trial([tmp_path / "trial.yaml"]).trial.part_models] == ["agv1"]
    (found,) = read_errors(tmp_path, f"{part}cell: {{based_on: gear2017}}\n")
    assert found == "trial.yaml:3: cellwright.parts.agv1: the model name 'agv1' is in use; choose another"
    (found,) = read_errors(tmp_path, f"{part}cell: {{carriers: {{agv1: {{at: [0, 3]}}}}}}\n")
    assert found == "trial.yaml:4: cell.carriers.agv1: a part type has this name; choose another"


def test_unknown_part_type_in_order_gives_suggestion(tmp_path: Path) -> None:
    path = tmp_path / "trial.yaml"
    path.write_text(
        parts(BOX) + "orders: {order_0: {announcement_condition: time, announcement_condition_value: 0, "
        "parts: {a: {type: my_prt, pose: {}}}}}\n"
    )
    (warning,) = load_trial([path]).warnings
    assert warning.message == "unknown part type 'my_prt', left out of the cell; did you mean my_part"


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{a: 1}", "must be a list (got a mapping)"),
        ("[{shapes: [{box: [1, 1, 1]}]}]", "the required entry 'name' is missing"),
        ("[{name: a}]", "needs either 'shapes' or 'file'"),
        ("[{name: a, mass: 2, shapes: [{box: [1, 1, 1]}]}]", "unknown entry; did you mean"),
        ("[{name: a, shapes: [{box: [30, 1, 1]}]}]", "(got 30 x 1 x 1)"),
        ("[{name: a, pose: {xyz: [0, 0]}, shapes: [{box: [1, 1, 1]}]}]", "must be a list of three numbers"),
        (
            "[{name: a, shapes: [{box: [1, 1, 1]}]}, {name: a, shapes: [{box: [1, 1, 1]}]}]",
            "another piece has this name",
        ),
    ],
)
def test_invalid_furniture_is_refused(entry: str, message: str, tmp_path: Path) -> None:
    found = read_errors(tmp_path, f"cellwright:\n  furniture: {entry}\n")
    assert message in found[0] or message.startswith("unknown entry")
    assert found[0].startswith("trial.yaml:2: cellwright.furniture")


SDF = "<sdf version='1.5'><model name='m'><link name='l'>{}</link></model></sdf>"
COLLISION = "<collision name='c'><geometry>{}</geometry></collision>"
SPHERE = COLLISION.format("<sphere><radius>0.01</radius></sphere>")
MASS = "<inertial><mass>1</mass></inertial>"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("<!DOCTYPE x [<!ENTITY a 'b'>]><sdf/>", "document types and entities are not supported; remove them"),
        ("<sdf>", "a.sdf:1: invalid XML"),
        ("<robt/>", "not an SDF, URDF or MJCF file (root element <robt>)"),
        ("<sdf><model/><model/></sdf>", "must have exactly one model (got 2)"),
        (SDF.format(MASS), "no collision or visual shape"),
        (SDF.format(MASS + COLLISION.format("<plane/>")), "shape <plane> is not supported (known: box, cylinder, "),
        (SDF.format(MASS + COLLISION.format("<sphere/>")), "radius must be 1 finite number (got None)"),
        (
            SDF.format(MASS + COLLISION.format("<box><size>1 nan 1</size></box>")),
            "size must be 3 finite numbers (got '1 nan 1')",
        ),
        (SDF.format(MASS + COLLISION.format("<mesh><uri>b.stl</uri></mesh>")), "there is no file b.stl"),
        (SDF.format(MASS + COLLISION.format("<mesh><uri>../b.stl</uri></mesh>")), "../b.stl is outside the model"),
        (SDF.format(SPHERE), "the required entry 'mass' [kg] is missing, and no model file has it"),
        (SDF.format(MASS + SPHERE + "<sensor/>"), "<sensor> is not supported; a model can have only shapes"),
        (
            "<robot><link name='a'/><link name='b'/><joint name='j' type='revolute'/></robot>",
            "joint 'j' is not fixed; a model must be one rigid body",
        ),
        (
            "<mujoco><include file='/etc/passwd'/></mujoco>",
            "<include> is not supported; put the model into one file with its meshes",
        ),
        ("<mujoco><asset><mesh file='../x.stl'/></asset></mujoco>", "../x.stl is outside the model folder"),
    ],
)
def test_invalid_model_file_is_refused(content: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.sdf").write_text(content)
    (found,) = read_errors(tmp_path, parts("{file: a.sdf}"))
    assert found.startswith("trial.yaml:3: cellwright.parts.my_part")
    assert message in found


def test_oversized_model_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.sdf").write_text(f"<!-- {'x' * (1 << 20)} --><sdf/>")
    assert "larger than 1 MiB" in read_errors(tmp_path, parts("{file: a.sdf}"))[0]


def test_model_folder_without_valid_config_is_refused(tmp_path: Path) -> None:
    (tmp_path / "model").mkdir()
    assert "no model.config in this folder" in read_errors(tmp_path, parts("{file: model}"))[0]
    (tmp_path / "model" / "model.config").write_text("<model><sdf>../../x.sdf</sdf></model>")
    assert "is outside the model folder" in read_errors(tmp_path, parts("{file: model}"))[0]


def test_fixed_links_are_merged_in_place(tmp_path: Path) -> None:
    (tmp_path / "a.urdf").write_text(
        """<robot name='r'>
        <link name='c'><collision><geometry><sphere radius='0.01'/></geometry></collision></link>
        <link name='a'><inertial><mass value='2'/></inertial></link><link name='b'/>
        <joint name='ab' type='fixed'><parent link='a'/><child link='b'/>
        <origin xyz='0.1 0 0' rpy='0 0 1.5707963267948966'/></joint>
        <joint name='bc' type='fixed'><parent link='b'/><child link='c'/><origin xyz='0.1 0 0'/></joint></robot>"""
    )
    model = load(tmp_path, parts("{file: a.urdf}")).part_models["my_part"]
    (shape,) = model.shapes
    assert model.mass == 2
    assert shape.pose.position == pytest.approx((0.1, 0.1, 0))
    assert shape.is_touched
    assert shape.is_seen


def test_joint_loop_in_model_is_refused(tmp_path: Path) -> None:
    joint = "<joint name='{0}{1}' type='fixed'><parent link='{0}'/><child link='{1}'/></joint>"
    links = "<link name='a'/><link name='b'/>"
    (tmp_path / "a.urdf").write_text(f"<robot>{links}{joint.format('a', 'b')}{joint.format('b', 'a')}</robot>")
    assert "has no path to a root link" in read_errors(tmp_path, parts("{file: a.urdf}"))[0]


TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2/1 3/1 4/1\nf -4 -1 -2\n"


def test_obj_mesh_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(TETRAHEDRON)
    assert load(tmp_path, parts("{mass: 1, shapes: [{mesh: a.obj, scale: [1, 1, 0.5]}]}")).part_models


def test_text_stl_mesh_is_read(tmp_path: Path) -> None:
    corners = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)]
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corners[k]) for k in facet)
        + "endloop\nendfacet\n"
        for facet in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    )
    (tmp_path / "a.stl").write_text(f"solid a\n{facets}endsolid a\n")
    assert load(tmp_path, parts("{mass: 1, shapes: [{mesh: a.stl}]}")).part_models


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.obj", "v 0 0 0\n", "the mesh has no triangles"),
        ("a.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a coordinate is not a finite number"),
        ("a.obj", "v 0 0 0\nf 1 2 3\n", "a triangle refers to a missing vertex"),
        ("a.obj", "v 0 0 x\n", "invalid OBJ file"),
        (
            "a.obj",
            "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0.1\nv 0.1 0.1 0.1\nf 1 2 3\nf 2 3 4\n",
            "the mesh is flat and has no volume",
        ),
        ("a.stl", "solid\nvertex 1 2\n", "invalid STL file"),
    ],
)
def test_invalid_mesh_is_refused(name: str, content: str, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content)
    (found,) = read_errors(tmp_path, parts(f"{{mass: 1, shapes: [{{mesh: {name}}}]}}"))
    assert message in found


def test_mesh_with_too_many_triangles_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshes, "MAX_TRIANGLES", 200)
    (tmp_path / "a.stl").write_bytes(bytes(80) + struct.pack("<I", 201) + bytes(50 * 201))
    (found,) = read_errors(tmp_path, parts("{mass: 1, shapes: [{mesh: a.stl}]}"))
    assert "too many triangles (got 201, at most 200)" in found


def test_mesh_in_millimetres_is_refused_as_too_large(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(TETRAHEDRON.replace("0.1", "100"))
    (found,) = read_errors(tmp_path, parts("{mass: 1, shapes: [{mesh: a.obj}]}"))
    assert "lengths of a mesh must be from 0.0001 to 20 m (got 100 x 100 x 100)" in found
    assert found.endswith("; for a mesh in millimetres write scale: 0.001")
