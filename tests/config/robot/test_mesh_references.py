"""Mesh references in the text of a URDF for external programs."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.config.robot.meshes import with_absolute_meshes
from cellwright.config.robot.urdf_file import read_text

URDF = '<robot><visual><geometry><mesh scale="1 1 1" filename="{}"/></geometry></visual></robot>'


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """Return the path of a URDF in a robot's folder that has one mesh."""
    mesh = tmp_path / "my arm" / "meshes" / "link & tip.stl"
    mesh.parent.mkdir(parents=True)
    mesh.write_bytes(b"")
    folder = tmp_path / "my arm" / "urdf"
    folder.mkdir()
    return folder / "arm.urdf"


@pytest.mark.parametrize("reference", ["../meshes/link &amp; tip.stl", "meshes/link &amp; tip.stl"])
def test_found_mesh_reference_becomes_absolute_uri(urdf: Path, reference: str) -> None:
    found = with_absolute_meshes(URDF.format(reference), urdf)
    address = (urdf.parents[1] / "meshes" / "link & tip.stl").as_uri()
    assert found == URDF.format(address)
    assert "my%20arm" in found


def test_package_mesh_becomes_absolute_only_without_package_xml(urdf: Path) -> None:
    (urdf.parents[1] / "meshes" / "a.stl").touch()
    (urdf.parents[1]).rename(urdf.parents[2] / "arm")
    path = urdf.parents[2] / "arm" / "urdf" / "arm.urdf"
    text = URDF.format("package://arm/meshes/a.stl")
    assert with_absolute_meshes(text, path) == URDF.format((path.parents[1] / "meshes" / "a.stl").as_uri())
    (path.parents[1] / "package.xml").touch()
    assert with_absolute_meshes(text, path) == text, "a real package is found by ROS, here and elsewhere"


@pytest.mark.parametrize(
    "reference", ["meshes/none.stl", "package://nowhere/a.stl", "http://x.invalid/a.stl", "\0", ""]
)
def test_missing_mesh_reference_stays_as_written(urdf: Path, reference: str) -> None:
    text = URDF.format(reference)
    assert with_absolute_meshes(text, urdf) == text


def test_text_without_meshes_is_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(b'<?xml version="1.0"?>\n<robot name="a">\x1a<link name="b"/></robot>\n')
    text = read_text(path)
    assert text == '<robot name="a"> <link name="b"/></robot>'
    assert with_absolute_meshes(text, path) == text
