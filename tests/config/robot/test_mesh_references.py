"""Mesh references in the published text of a URDF, for external programs."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.config.robot.description import description
from cellwright.config.robot.model import Link, RobotModel

URDF = (
    '<robot name="r"><link name="a"><visual><geometry><mesh scale="1 1 1" filename="{}" /></geometry></visual></link>'
    "</robot>"
)
ROBOT = RobotModel("r", "a", {"a": Link("a")}, ())


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """Return the path of a URDF in a robot's folder that has one mesh."""
    mesh = tmp_path / "my arm" / "meshes" / "link & tip.stl"
    mesh.parent.mkdir(parents=True)
    mesh.write_bytes(b"")
    folder = tmp_path / "my arm" / "urdf"
    folder.mkdir()
    return folder / "arm.urdf"


def published(reference: str, path: Path) -> str:
    return description(URDF.format(reference), ROBOT, path)


@pytest.mark.parametrize(
    "reference",
    [
        "../meshes/link &amp; tip.stl",
        "meshes/link &amp; tip.stl",
        "meshes/link%20%26%20tip.stl",
        "package:///meshes/link &amp; tip.stl",
    ],
)
def test_found_mesh_reference_becomes_absolute_uri(urdf: Path, reference: str) -> None:
    address = (urdf.parents[1] / "meshes" / "link & tip.stl").as_uri()
    assert published(reference, urdf) == URDF.format(address)
    assert "my%20arm" in address


def test_package_mesh_becomes_absolute_only_without_package_xml(urdf: Path) -> None:
    (urdf.parents[1] / "meshes" / "a.stl").touch()
    (urdf.parents[1]).rename(urdf.parents[2] / "arm")
    path = urdf.parents[2] / "arm" / "urdf" / "arm.urdf"
    reference, address = "package://arm/meshes/a.stl", (path.parents[1] / "meshes" / "a.stl").as_uri()
    assert published(reference, path) == URDF.format(address)
    (path.parents[1] / "package.xml").touch()
    assert published(reference, path) == URDF.format(reference), "a real package is found by ROS, here and elsewhere"
    assert published("package:///meshes/a.stl", path) == URDF.format(address), "ROS finds no package without a name"


@pytest.mark.parametrize("reference", ["meshes/none.stl", "package://nowhere/a.stl", "http://x.invalid/a.stl"])
def test_missing_mesh_reference_stays_as_written(urdf: Path, reference: str) -> None:
    assert published(reference, urdf) == URDF.format(reference)
