"""Mesh files as exporters write them: bytes beyond ASCII, letters of any case, and what follows the triangles."""

import struct
from pathlib import Path

import numpy as np
import pytest

from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import read_mesh, read_surfaces
from tests.config.models.dae_files import RED, two_colours

CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]
LINES = "".join(f"   vertex {x:e} {y:e} {z:e}\n" for x, y, z in CORNERS)
TEXT = f"solid part\n facet normal 0 0 1\n  outer loop\n{LINES}  endloop\n endfacet\nendsolid part\n"
FACET = struct.pack("<12fH", 0, 0, 1, *(number for corner in CORNERS for number in corner), 0)
DAE = two_colours()
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0.5\nf 1 2 3\n"


def binary(header: bytes = b"", facets: int = 1, announced: int | None = None) -> bytes:
    count = facets if announced is None else announced
    return header.ljust(80, b"\0") + struct.pack("<I", count) + FACET * facets


def read(folder: Path, name: str, content: bytes) -> list[list[float]]:
    """Return the corners of the mesh's first triangle."""
    path = folder / name
    path.write_bytes(content)
    vertices, triangles = read_mesh(path)
    corners: list[list[float]] = vertices[triangles[0]].tolist()
    return corners


@pytest.mark.parametrize(
    "content",
    [
        TEXT.replace("part", "Gehäuse").encode("latin-1"),
        TEXT.replace("part", "Gehäuse").encode(),
        TEXT.upper().encode(),
        TEXT.replace("\n", "\r\n").encode(),
        TEXT.encode() + b"\0\x1a",
        TEXT.encode() + "solid ä\nendsolid ä".encode("cp437"),
    ],
)
def test_text_stl_of_any_exporter_is_read(tmp_path: Path, content: bytes) -> None:
    assert read(tmp_path, "a.stl", content) == CORNERS


@pytest.mark.parametrize(
    "content",
    [
        binary(),
        binary(b"solid of an exporter that writes binary files"),
        binary() + b"\0",
        binary() + b"\r\n",
        binary(b"solid facet") + b"colours: red",
        binary("Gehäuse".encode("latin-1")) + bytes(1000),
    ],
)
def test_binary_stl_with_any_header_and_end_is_read(tmp_path: Path, content: bytes) -> None:
    assert read(tmp_path, "a.STL", content) == CORNERS


@pytest.mark.parametrize(
    "content",
    [
        "# Schlüssel\no Gehäuse\n".encode("latin-1") + OBJ.encode(),
        OBJ.replace("f 1 2 3", "f 1 \\\n 2 \\\r\n 3").encode(),
        OBJ.replace("f 1 2 3", "f 1 2 3 # the only face").encode(),
        OBJ.replace("v 1 0 0", "v 1 0 0# second").encode(),
        OBJ.replace("\n", "\r\n").encode(),
        OBJ.replace("f 1 2 3", "usemtl \x85\nf 1/1/1 2//2 -1").encode("latin-1"),
        OBJ.strip().encode() + b"\x1a",
        OBJ.strip().encode() + b"\0\0\0",
    ],
)
def test_obj_of_any_exporter_is_read(tmp_path: Path, content: bytes) -> None:
    assert np.allclose(read(tmp_path, "a.obj", content), CORNERS)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.stl", binary(facets=2, announced=5), r"a\.stl: cut short, with 2 of 5 triangles"),
        ("a.stl", binary()[:90], r"a\.stl: cut short, with 0 of 1 triangles"),
        ("a.stl", TEXT.replace("e+00", ",0").encode(), r"a\.stl: invalid STL file"),
        ("a.obj", OBJ.replace("f 1 2 3", "f 0 1 2").encode(), r"a\.obj: invalid OBJ file"),
        (
            "a.stl",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:12\n",
            r"a\.stl: a Git LFS pointer, not the ",
        ),
    ],
)
def test_unusable_mesh_is_refused_with_reason(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    with pytest.raises(ModelFileError, match=message):
        read(tmp_path, name, content)


def test_dae_is_read_as_one_mesh_and_as_surfaces(tmp_path: Path) -> None:
    (tmp_path / "a.DAE").write_text(DAE)
    vertices, triangles = read_mesh(tmp_path / "a.DAE")
    assert (vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()) == ([0, 0, 0], [1, 1, 1])
    surfaces = read_surfaces(tmp_path / "a.DAE")
    assert [surface.colour for surface in surfaces] == [RED, (0.0, 0.0, 1.0, 1.0)]
    assert [len(surface.triangles) for surface in surfaces] == [2, 2]
    assert len(triangles) == 4


def test_mesh_without_colours_is_one_surface(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    (surface,) = read_surfaces(tmp_path / "a.obj")
    assert (surface.colour, len(surface.triangles)) == (None, 1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (DAE.replace("1.0", "1.0.0"), r"a\.dae: invalid DAE file"),
        (DAE.replace("<p>", "<p>99999999999999999999 "), r"a\.dae: invalid DAE file"),
        (DAE.replace("1.0", "inf"), r"a\.dae: a coordinate is not a finite number"),
        (DAE[:100], r"a\.dae: line 1: invalid XML \(.*\); export the mesh again, or convert it to STL"),
    ],
)
def test_unusable_dae_is_refused_with_its_path(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(ModelFileError, match=message):
        read(tmp_path, "a.dae", content.encode())
