"""Meshes: their search, and the links whose meshes are unusable."""

import struct
from pathlib import Path

import pytest

from cellwright.config.robot import meshes
from cellwright.config.robot.meshes import MeshFinder
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.robot.urdf_file import package_folders
from tests.config.robot.test_urdf import robot

TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 0, 0), (0, 0, 1), (1, 0, 0)]


def stl() -> bytes:
    facets = b"".join(struct.pack("<12fH", 0, 0, 0, *sum(corners, ()), 0) for corners in TETRAHEDRON)
    return bytes(80) + struct.pack("<I", len(TETRAHEDRON)) + facets


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return a checkout of a package under another name, as downloaded from a web page."""
    folder = tmp_path / "arm_description-main"
    for below in ("urdf", "meshes"):
        (folder / below).mkdir(parents=True)
    (folder / "package.xml").write_text("<package>\n <name>arm_description</name></package>")
    for below in ("meshes", "urdf"):
        (folder / below / "link 1.stl").write_bytes(stl())
    return folder


@pytest.mark.parametrize(
    "reference",
    [
        "package://arm_description/meshes/link 1.stl",
        "package://arm_description/meshes/link%201.stl",
        "model://arm_description/meshes/link 1.stl",
        "package://arm_description-main/meshes/link 1.stl",
        "../meshes/link 1.stl",
        "..\\meshes\\link 1.stl",
        "meshes/link 1.stl",
        "../meshes/link%201.stl",
        "package:///meshes/link 1.stl",
        "package://meshes/link 1.stl",
        "package://link 1.stl",
        "package://arm_description//meshes///link 1.stl",
        "Package://arm_description/meshes\\link 1.stl",
        "file://meshes/link%201.stl",
    ],
)
def test_mesh_finder_resolves_relative_and_package_references(package: Path, reference: str) -> None:
    finder = MeshFinder(package / "urdf" / "arm.urdf")
    found = finder.find(reference)
    assert found is not None
    assert found.samefile(package / ("urdf" if reference == "package://link 1.stl" else "meshes") / "link 1.stl")
    assert finder.missing == {}


def test_mesh_finder_resolves_absolute_path_and_file_uri(package: Path) -> None:
    finder = MeshFinder(package / "urdf" / "arm.urdf")
    path = (package / "meshes" / "link 1.stl").as_posix()
    escaped = path.replace(" ", "%20")
    for reference in (path, f"file://{escaped}", f"file://localhost{escaped}", f"FILE:{escaped}", f"file://{path}"):
        assert finder.find(reference) == Path(path), reference


def test_package_folders_end_with_ros_environment_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}/one:{tmp_path}/two/arm")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/three")
    found = list(package_folders("arm", Path("/elsewhere/urdf/arm.urdf")))
    assert found[-4:] == [
        tmp_path / "one" / "arm",
        tmp_path / "two" / "arm" / "arm",
        tmp_path / "two" / "arm",
        tmp_path / "three" / "share" / "arm",
    ]


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("a.ply", b"ply", "must be an .stl, .obj or .dae file; convert the mesh"),
        ("a.dae", b"<COLLADA/>", "the mesh has no triangles"),
        ("a.stl", b"solid nothing", "the mesh has no triangles"),
        ("a.obj", b"v 1 2", "invalid OBJ file"),
        ("b.stl", b"", "not found"),
        (
            "a.obj",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n",
            "a Git LFS pointer, not the file itself; fetch the file with: git lfs pull",
        ),
    ],
)
def test_unusable_mesh_is_recorded_with_reason(tmp_path: Path, name: str, content: bytes, why: str) -> None:
    (tmp_path / name.replace("b.stl", "c.stl")).write_bytes(content)
    finder = MeshFinder(tmp_path / "arm.urdf")
    assert finder.find(name) is None
    assert finder.find(name) is None
    assert finder.missing == {name: why}


def test_mesh_beyond_total_size_is_missing(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (package / "meshes" / "other.stl").write_bytes(stl())
    monkeypatch.setattr(meshes, "MAX_TOTAL_BYTES", len(stl()) + 1)
    finder = MeshFinder(package / "urdf" / "arm.urdf")
    assert finder.find("../meshes/link 1.stl") is not None
    assert finder.find("../meshes/link 1.stl") is not None
    assert finder.find("../meshes/other.stl") is None
    assert list(finder.missing) == ["../meshes/other.stl"]


def test_missing_meshes_give_one_warning(tmp_path: Path) -> None:
    visuals = "".join(f'<visual><geometry><mesh filename="{n}.dae"/></geometry></visual>' for n in range(7))
    path = tmp_path / "arm.urdf"
    path.write_text(robot(f'<link name="a">{visuals}</link>'))
    warnings: list[str] = []
    found = read_urdf(path, warn=warnings.append)
    expected = "7 meshes in 1 link cannot be used, the first '0.dae': not found; simple shapes are used"
    assert warnings == [f"{path}:1: {expected}"]
    assert [shape.kind for shape in found.links["a"].shapes] == ["sphere"]


def test_mesh_in_millimetres_without_scale_gives_one_warning(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(stl())
    shape = '<visual><geometry><mesh filename="a.stl" scale="{0} {0} {0}"/></geometry></visual>'
    path = tmp_path / "arm.urdf"
    warnings: list[str] = []
    for scale in (19, -19):
        path.write_text(robot(f'<link name="a">{shape.format(scale)}</link>'))
        read_urdf(path, warn=warnings.append)
    assert warnings == []
    path.write_text(robot(f'<link name="a">{shape.format(-300)}{shape.format(21)}</link>'))
    read_urdf(path, warn=warnings.append)
    message = "a mesh is longer than 20 m, the first 'a.stl' with 300 m; for a mesh in millimetres write"
    assert warnings == [f'{path}:1: {message} scale="0.001 0.001 0.001"']
