"""Mesh files, STL, OBJ and DAE: triangles, or a refusal."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import is_flat, read_mesh
from fuzz import seeds as bundled
from fuzz.verdict import FindingError, check_lines

MAX_SIZE = 3000
WORDS = (
    "solid",
    "facet normal",
    "outer loop",
    "vertex",
    "endloop",
    "endfacet",
    "v ",
    "f ",
    "vn",
    "1//1",
    "-1",
    "nan",
    "1e39",
    '<node id="n">',
    '<instance_node url="#n"/>',
    '<instance_geometry url="#g"/>',
    "<polylist>",
    "<vcount>4</vcount>",
    "<p>0 1 2 3</p>",
    "<matrix>",
    "<!DOCTYPE a>",
)
_DAE = (
    '<COLLADA><library_effects><effect id="e"><diffuse><color>1 0 0 1</color></diffuse></effect></library_effects>'
    '<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>'
    '<library_geometries><geometry id="g"><mesh><source id="s"><float_array>0 0 0 1 0 0 0 1 0 0 0 1</float_array>'
    '<technique_common><accessor stride="3"/></technique_common></source>'
    '<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>'
    '<polylist material="m"><input semantic="VERTEX" source="#v" offset="0"/><vcount>4 3</vcount>'
    "<p>0 1 2 3 1 3 2</p></polylist></mesh></geometry></library_geometries>"
    '<library_visual_scenes><visual_scene id="w"><node><rotate>0 0 1 90</rotate><instance_geometry url="#g"/></node>'
    "</visual_scene></library_visual_scenes></COLLADA>"
)
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))


def seeds() -> Iterator[bytes]:
    """Yield a body in every format."""
    yield from bundled.files("docs/examples/**/*.stl")
    yield b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1/1 2/2 -1/3\nf 1 2 3 4\n"
    yield b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet"
    yield _DAE.encode()
    yield b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", *range(12), 0)


def attempt(data: bytes) -> None:
    """Read the bytes in each format."""
    for kind in ("stl", "obj", "dae"):
        path = _FOLDER / f"mesh.{kind}"
        path.write_bytes(data)
        try:
            vertices, triangles = read_mesh(path)
        except ModelFileError as error:
            check_lines([error], [str(path)])
            continue
        is_flat(vertices)
        if not np.isfinite(vertices[triangles]).all():
            raise FindingError("a corner that is nowhere")
