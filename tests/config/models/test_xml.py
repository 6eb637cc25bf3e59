"""URDF files as models of parts: what they share with robots."""

from pathlib import Path

import pytest

from cellwright.config.models.files import FileReference, ModelFileError, open_model, referenced_file
from cellwright.config.models.xml import read_xml
from cellwright.util.pose import Pose

LINK = '<link name="a"><collision><origin {}/><geometry><box size="1 1 1"/></geometry></collision></link>'


def pose(folder: Path, origin: str, version: str = "") -> Pose:
    """Return the pose of a shape with this origin."""
    path = folder / "a.urdf"
    path.write_text(f"<robot {version}>{LINK.format(origin)}</robot>")
    return read_xml(open_model(path), folder).shapes[0].pose


def test_quaternion_of_part_has_w_last(tmp_path: Path) -> None:
    found = pose(tmp_path, 'xyz="1 2 3" quat_xyzw="0 0 3 4"', 'version="1.2"')
    assert found.position == (1.0, 2.0, 3.0)
    assert found.quaternion == pytest.approx((0.8, 0.0, 0.0, 0.6))


@pytest.mark.parametrize(
    ("origin", "version", "message"),
    [
        ('quat_xyzw="0 0 0 0"', "", "quat_xyzw must be a unit quaternion"),
        ('quat_xyzw="0 0 0 1" rpy="0 0 0"', "", "quat_xyzw must be a unit quaternion, without rpy beside it"),
        ('quat_xyzw="0 0 1"', "", "quat_xyzw must be 4 finite numbers"),
        ("", 'version="2.0"', r"unknown version '2\.0' of URDF \(known: 1\.0, 1, 1\.1, 1\.2\)"),
    ],
)
def test_invalid_orientation_or_version_of_part_is_refused(
    tmp_path: Path, origin: str, version: str, message: str
) -> None:
    with pytest.raises(ModelFileError, match=message):
        pose(tmp_path, origin, version)


@pytest.mark.parametrize(
    "reference",
    [
        "meshes/a b.stl",
        "meshes/a%20b.stl",
        "meshes\\a b.stl",
        "file://meshes/a b.stl",
        "package://part/meshes/a%20b.stl",
        "package://part//meshes/a b.stl",
        "package:///meshes/a b.stl",
        "model://part/meshes/a b.stl",
    ],
)
def test_mesh_of_part_is_found_by_any_reference(tmp_path: Path, reference: str) -> None:
    folder = tmp_path / "part"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "a b.stl").touch()
    assert referenced_file(folder / "a.sdf", reference, folder).samefile(folder / "meshes" / "a b.stl")


@pytest.mark.parametrize("reference", ["../b.stl", "file:///b.stl", "package://part/../../b.stl", "%2e%2e/b.stl"])
def test_mesh_outside_of_folder_of_part_is_refused(tmp_path: Path, reference: str) -> None:
    folder = tmp_path / "part"
    folder.mkdir()
    (tmp_path / "b.stl").touch()
    with pytest.raises(ModelFileError, match=r"is outside the model folder"):
        referenced_file(folder / "a.sdf", reference, folder)


def test_literal_percent_sign_precedes_decoded_one() -> None:
    assert FileReference.read("a%20b.stl").paths == ("a%20b.stl", "a b.stl")
    assert FileReference.read("file://localhost/a.stl") == FileReference(None, ("/a.stl",))
    assert FileReference.read("file://localhostile/a.stl").paths == ("localhostile/a.stl",)
