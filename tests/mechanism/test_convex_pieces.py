"""Convex pieces: made once, kept in the cache, made again when damaged, and refused without CoACD."""

from importlib.metadata import PackageNotFoundError
from pathlib import Path

import numpy as np
import pytest

from cellwright.config.models.meshes import Triangles, read_mesh
from cellwright.mechanism import convex_pieces as module
from cellwright.mechanism.convex_pieces import convex_pieces
from cellwright.util.errors import UsageError
from cellwright.util.pose import Vector3

CORNER = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
ANGLE = (
    CORNER
    + CORNER.replace(" 0\n", " 1\n")
    + "f 1 3 2\nf 1 4 3\nf 1 6 4\nf 4 6 5\nf 7 8 9\nf 7 9 10\nf 7 10 12\nf 10 11 12\n"
    + "".join(f"f {k} {k % 6 + 1} {k % 6 + 7}\nf {k} {k % 6 + 7} {k + 6}\n" for k in range(1, 7))
)
"""A prism over an L of three unit squares: its hull has half a cube more."""
UNIT = (1.0, 1.0, 1.0)


@pytest.fixture
def angle(tmp_path: Path) -> Path:
    path = tmp_path / "angle.obj"
    path.write_text(ANGLE)
    return path


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Divide meshes into two without CoACD; return the list of the divided ones."""
    divided: list[Path] = []

    def divide(path: Path, mesh: Triangles, threshold: float) -> list[Triangles]:
        divided.append(path)
        vertices, triangles = mesh
        return [(vertices, triangles), (vertices + 1.0, triangles)]

    monkeypatch.setattr(module, "_divide", divide)
    monkeypatch.setattr(module, "version", lambda _name: "1.0")
    return divided


def pieces(path: Path, scale: Vector3 = UNIT, threshold: float = 0.05) -> tuple[Path, ...]:
    return convex_pieces(path, scale, threshold, {"XDG_CACHE_HOME": str(path.parent / "cache")})


def test_pieces_are_made_once_and_kept_as_meshes(angle: Path, made: list[Path]) -> None:
    found = pieces(angle)
    assert pieces(angle) == found
    assert made == [angle]
    assert [path.parents[1] for path in found] == [angle.parent / "cache" / "cellwright" / "pieces"] * 2
    vertices, triangles = read_mesh(found[1])
    assert (vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()) == ([1, 1, 1], [3, 3, 2])
    assert len(triangles) == len(read_mesh(angle)[1])


def test_other_content_scale_threshold_or_version_makes_other_pieces(
    angle: Path, made: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = {pieces(angle), pieces(angle, (2.0, 1.0, 1.0)), pieces(angle, threshold=0.1)}
    monkeypatch.setattr(module, "version", lambda _name: "1.1")
    found.add(pieces(angle))
    angle.write_text(ANGLE.replace("v 2 0 0", "v 3 0 0"))
    found.add(pieces(angle))
    assert len(found) == len(made) == 5
    copy = angle.with_name("copy.obj")
    copy.write_text(angle.read_text())
    assert pieces(copy) in found


@pytest.mark.parametrize("name", ["piece_0.stl", "piece_1.stl", "pieces.json"])
@pytest.mark.parametrize("damage", ["removed", "cut", "changed", "empty"])
def test_damaged_entry_is_made_again(angle: Path, made: list[Path], name: str, damage: str) -> None:
    found = pieces(angle)
    whole = {path: path.read_bytes() for path in found[0].parent.iterdir()}
    file = found[0].parent / name
    content = whole[file]
    if damage == "removed":
        file.unlink()
    else:
        file.write_bytes({"cut": content[:-7], "changed": content[:90] + b"0" + content[91:], "empty": b""}[damage])
    assert pieces(angle) == found
    assert len(made) == 2
    assert {path: path.read_bytes() for path in found[0].parent.iterdir()} == whole


def test_entry_that_lists_fewer_pieces_is_made_again(angle: Path, made: list[Path]) -> None:
    found = pieces(angle)
    for content in (
        '{"sha256": []}',
        "[]",
        '{"sha256": 3}',
        found[0].with_name("pieces.json").read_text()[:77] + '"]}',
    ):
        found[0].with_name("pieces.json").write_text(content)
        assert pieces(angle) == found


def test_cache_that_cannot_be_written_is_refused_with_what_to_do(angle: Path, made: list[Path]) -> None:
    angle.with_name("cache").write_text("a file")
    with pytest.raises(UsageError, match=r"cannot be written: .*; name another folder in XDG_CACHE_HOME"):
        pieces(angle)


def test_pieces_without_coacd_are_refused_with_the_command(angle: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(module, "version", missing)
    with pytest.raises(UsageError, match=r"need the package coacd; run: pip install 'cellwright\[arms\]', or take"):
        pieces(angle)


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("import sys; sys.exit('no mesh')", r"angle\.obj: CoACD makes no pieces of it \(no mesh\); repair the mesh"),
        ("import os; os.abort()", r"angle\.obj: CoACD makes no pieces of it \(status -6\); repair the mesh"),
        ("import signal; signal.pause()", r"angle\.obj: CoACD takes longer than 0\.3 s for its pieces; simplify"),
    ],
)
def test_mesh_that_coacd_cannot_divide_is_refused(
    angle: Path, monkeypatch: pytest.MonkeyPatch, program: str, message: str
) -> None:
    monkeypatch.setattr(module, "version", lambda _name: "1.0")
    monkeypatch.setattr(module, "_PROGRAM", program)
    monkeypatch.setattr(module, "MAX_TIME", 0.3 if "pause" in program else 60.0)
    with pytest.raises(UsageError, match=message):
        pieces(angle)


@pytest.mark.slow
def test_coacd_divides_an_angle_into_two_boxes_and_twice_alike(angle: Path) -> None:
    pytest.importorskip("coacd")
    found = pieces(angle)
    assert len(found) == 2
    contents = [path.read_bytes() for path in found]
    for path in found:
        path.unlink()
    assert [path.read_bytes() for path in pieces(angle)] == contents
    corners = [read_mesh(path)[0] for path in found]
    volumes = [float(np.prod(np.ptp(each, axis=0))) for each in corners]
    assert sorted(volumes) == pytest.approx([1.0, 2.0], rel=0.02)
