"""DAE files: triangles of every kind, placed and coloured as the file says, and the bounds of a hostile one."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.models import dae
from cellwright.config.models.dae import joined, read_dae
from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import read_mesh, read_surfaces
from cellwright.config.models.model import Surface
from tests.config.models.dae_files import FACE, RED, SQUARE, collada, geometry

BLUE = (0.0, 0.0, 1.0, 1.0)


def read(content: str, max_triangles: int = 1000) -> tuple[Surface, ...]:
    return read_dae(content.encode(), max_triangles)


def corners(content: str) -> list[list[list[float]]]:
    """Return the corners of all triangles."""
    vertices, triangles = joined(read(content))
    found: list[list[list[float]]] = vertices[triangles].tolist()
    return found


@pytest.mark.parametrize(
    "primitive",
    [
        "<triangles {}><p>0 1 2 0 2 3</p></triangles>",
        "<polylist {}><vcount>4</vcount><p>0 1 2 3</p></polylist>",
        "<polylist {}><vcount>3 2 3</vcount><p>0 1 2 1 3 0 2 3</p></polylist>",
        "<polygons {}><p>0 1 2 3</p></polygons>",
        "<polygons {}><p>0 1 2</p><p>0 2 3</p></polygons>",
        "<polygons {}><ph><p>0 1 2 3</p><h>0 1 2</h></ph></polygons>",
        "<trifans {}><p>0 1 2 3</p></trifans>",
    ],
)
def test_each_kind_of_polygon_becomes_triangles(primitive: str) -> None:
    a, b, c, d = SQUARE
    face = primitive.format('material="m"').replace("><", ">" + FACE.format(0) + "<", 1)
    assert corners(collada(geometry(face))) == [[a, b, c], [a, c, d]]


def test_strip_keeps_its_outside() -> None:
    a, b, c, d = SQUARE
    strip = f"<tristrips>{FACE.format(0)}<p>0 1 3 2</p></tristrips>"
    assert corners(collada(geometry(strip))) == [[a, b, d], [d, b, c]]


def test_indices_of_normals_and_textures_are_skipped() -> None:
    face = FACE.format(1) + '<input semantic="NORMAL" source="#n" offset="0"/>'
    primitive = f"<triangles>{face}<p>7 0 7 1 7 2</p></triangles>"
    assert corners(collada(geometry(primitive))) == [SQUARE[:3]]


def test_vertices_that_no_triangle_uses_are_left_out() -> None:
    (surface,) = read(collada(geometry(f"<triangles>{FACE.format(0)}<p>1 2 3</p></triangles>")))
    assert len(surface.vertices) == 3


@pytest.mark.parametrize(
    ("steps", "expected"),
    [
        ("<translate>1 2 3</translate>", (2, 2, 3)),
        ("<scale>2 3 4</scale>", (2, 0, 0)),
        ("<rotate>0 0 2 90</rotate>", (0, 1, 0)),
        ("<matrix>0 -1 0 5 1 0 0 0 0 0 1 0 0 0 0 1</matrix>", (5, 1, 0)),
        ("<translate>1 0 0</translate><rotate>0 0 1 180</rotate>", (0, 0, 0)),
        ("<rotate>0 0 1 180</rotate><translate>1 0 0</translate>", (-2, 0, 0)),
    ],
)
def test_nodes_place_their_meshes(steps: str, expected: tuple[float, float, float]) -> None:
    content = collada(geometry(), node=f"{steps}<instance_geometry url='#g'/>")
    assert corners(content)[0][1] == pytest.approx(expected, abs=1e-12)


def test_nested_and_instanced_nodes_move_with_their_parents() -> None:
    library = (
        '<library_nodes><node id="n"><translate>0 0 1</translate><instance_geometry url="#g"/></node></library_nodes>'
    )
    use = '<instance_node url="#n"/>'
    node = f"<translate>1 0 0</translate><node><scale>2 2 2</scale>{use}</node>{use}"
    places = [triangle[0] for triangle in corners(collada(geometry() + library, node=node))]
    assert places == [[1, 0, 2], [1, 0, 2], [1, 0, 1], [1, 0, 1]]


def test_mirrored_mesh_keeps_its_outside() -> None:
    content = collada(geometry(), node="<scale>1 1 -1</scale><instance_geometry url='#g'/>")
    a, b, c = (np.array(corner) for corner in corners(content)[0])
    assert np.cross(b - a, c - a)[2] < 0


def test_unit_is_applied_and_up_axis_is_not() -> None:
    content = collada(geometry(), asset="<asset><unit meter='0.001'/><up_axis>Y_UP</up_axis></asset>")
    assert corners(content)[0] == [[0, 0, 0], [0.001, 0, 0], [0.001, 0.001, 0]]


def test_colours_of_materials_are_those_of_surfaces() -> None:
    primitives = "".join(
        f"<triangles material='{symbol}'>{FACE.format(0)}<p>0 1 2 0 2 3</p></triangles>"
        for symbol in ("r", "b", "x", "r")
    )
    bound = "".join(f"<instance_material symbol='{name}' target='#{name}-m'/>" for name in ("r", "b"))
    bound = f"<bind_material><technique_common>{bound}</technique_common></bind_material>"
    surfaces = read(collada(geometry(primitives), node=f"<instance_geometry url='#g'>{bound}</instance_geometry>"))
    assert [(surface.colour, len(surface.triangles)) for surface in surfaces] == [(RED, 4), (BLUE, 2), (None, 2)]


def test_colour_of_a_material_that_is_not_bound_is_found_by_its_name() -> None:
    (surface,) = read(collada(geometry(f"<triangles material='r-m'>{FACE.format(0)}<p>0 1 2</p></triangles>")))
    assert surface.colour == RED


def test_surface_that_the_engine_cannot_draw_joins_the_largest() -> None:
    primitives = (
        f"<triangles material='r-m'>{FACE.format(0)}<p>0 1 2</p></triangles>"
        f"<triangles material='b-m'>{FACE.format(0)}<p>0 1 2 0 2 3</p></triangles>"
    )
    (surface,) = read(collada(geometry(primitives)))
    assert (surface.colour, len(surface.triangles)) == (BLUE, 3)


@given(st.lists(st.integers(0, 7), max_size=12))
def test_polygons_have_two_triangles_less_than_corners(counts: list[int]) -> None:
    indices = " ".join(str(number % 4) for number in range(sum(counts)))
    words = " ".join(map(str, counts))
    content = collada(geometry(f"<polylist>{FACE.format(0)}<vcount>{words}</vcount><p>{indices}</p></polylist>"))
    assert len(corners(content)) == sum(max(count - 2, 0) for count in counts)


@given(st.lists(st.floats(-1e6, 1e6), max_size=40), st.integers(1, 12))
def test_numbers_are_the_same_in_portions_of_any_length(numbers: list[float], length: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dae, "_PORTION", length)
        assert dae._floats("\n ".join(map(repr, numbers))).tolist() == numbers


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("<svg/>", r"not a COLLADA file \(root element <svg>\)"),
        ("<COLLADA><a></COLLADA>", r"line 1: invalid XML \(mismatched tag\); export the mesh again"),
        (
            "<!DOCTYPE a [<!ENTITY b 'c'>]><COLLADA>&b;</COLLADA>",
            "line 1: document types and entities are not supported",
        ),
        (collada(geometry(f"<triangles>{FACE.format(0)}<p>0 1 4</p></triangles>")), "refers to a missing vertex"),
        (collada(geometry(f"<triangles>{FACE.format(0)}<p>0 1 -1</p></triangles>")), "refers to a missing vertex"),
        (collada(geometry("<triangles><p>0 1 2</p></triangles>")), "<triangles> has no vertices"),
        (collada(geometry(f"<triangles>{FACE.format(-1)}<p>0 1 2</p></triangles>")), "<triangles> has no vertices"),
        (
            collada(geometry(f"<triangles>{FACE.format(0).replace('#v', '#w')}<p>0 1 2</p></triangles>")),
            "'#w' of vertices are",
        ),
        (
            collada(geometry(f"<polylist>{FACE.format(0)}<vcount>5</vcount><p>0 1 2</p></polylist>")),
            "more corners than",
        ),
        (
            collada(geometry(f"<polylist>{FACE.format(0)}<vcount>-3 6</vcount><p>0 1 2</p></polylist>")),
            "more corners than",
        ),
        (collada(geometry().replace('stride="3"', 'stride="2"')), r"a position must have 3 numbers \(got 2\)"),
        (collada(geometry(), node="<translate>1 2</translate>"), "<translate> must be 3 finite numbers"),
        (collada(geometry(), node="<scale>1 2 nan</scale>"), "<scale> must be 3 finite numbers"),
        (collada(geometry(), asset="<asset><unit meter='0'/></asset>"), r"unit must be a length above 0 m \(got 0\)"),
        (collada(geometry(), node="<instance_node url='#top'/>"), "nodes nested deeper than 100, or in a loop; export"),
        ("<a>" * 101, "line 1: elements nested deeper than 100; simplify the mesh"),
    ],
)
def test_unusable_file_is_refused_with_reason(content: str, message: str) -> None:
    with pytest.raises(ModelFileError, match=message):
        read(content)


def test_nodes_that_multiply_are_refused_without_following_them_all() -> None:
    """Thirty nodes, each of which uses the next one twice, would be a thousand million."""
    use = "<instance_node url='#n{0}'/>"
    nodes = "".join(f'<node id="n{k}">{use.format(k + 1) * 2}</node>' for k in range(30))
    content = collada(geometry() + f"<library_nodes>{nodes}</library_nodes>", node=use.format(0))
    with pytest.raises(ModelFileError, match="the scene has more than 500000 elements; simplify the mesh"):
        read(content)


def test_meshes_that_multiply_are_refused() -> None:
    content = collada(geometry(), node="<instance_geometry url='#g'/>" * 6)
    assert len(corners(content)) == 12
    with pytest.raises(ModelFileError, match=r"too many triangles \(more than 11\); simplify the mesh"):
        read(content, 11)


def test_elements_and_colours_beyond_their_bounds_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dae, "MAX_ELEMENTS", 10)
    with pytest.raises(ModelFileError, match="line 1: more than 10 elements; simplify the mesh"):
        read(collada(geometry()))
    monkeypatch.undo()
    monkeypatch.setattr(dae, "MAX_COLOURS", 1)
    square = f"{FACE.format(0)}<p>0 1 2 0 2 3</p>"
    two = f"<triangles material='r-m'>{square}</triangles><triangles material='b-m'>{square}</triangles>"
    with pytest.raises(ModelFileError, match=r"too many colours \(got 2, at most 1\)"):
        read(collada(geometry(two)))


def test_file_without_triangles_is_no_mesh(tmp_path: Path) -> None:
    path = tmp_path / "a.dae"
    path.write_text(collada(geometry("<lines><p>0 1</p></lines>")))
    with pytest.raises(ModelFileError, match=f"{path}: the mesh has no triangles"):
        read_mesh(path)


def test_real_file_equals_the_stl_of_the_same_part() -> None:
    """The file says that its y axis is up; its STL has the same axes all the same."""
    folder = Path(pytest.importorskip("pybullet_data").getDataPath()) / "racecar" / "meshes"
    (surface,) = read_surfaces(folder / "chassis.dae")
    vertices, _ = read_mesh(folder / "chassis.STL")
    for pick in (np.min, np.max):
        assert pick(surface.vertices, axis=0) == pytest.approx(pick(vertices, axis=0), abs=1e-6)
    assert math.isclose(np.ptp(vertices[:, 0]), 0.405, rel_tol=1e-3)
