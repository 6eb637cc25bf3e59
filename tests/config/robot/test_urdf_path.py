"""URDF of a configuration: beside it, one folder up as in old revisions, or a hint at existing ones."""

from pathlib import Path

import pytest

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Problems
from cellwright.config.robot.robots import find_urdf, read_robot_config, read_tree
from cellwright.util.errors import DescriptionError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return descriptions/robot with its URDF in a folder of its own."""
    found = tmp_path / "descriptions" / "robot"
    (found / "urdf").mkdir(parents=True)
    (found / "urdf" / "robot.urdf").touch()
    return found


def find(folder: Path, text: str) -> tuple[Path | None, list[str]]:
    path = folder / "vr_configs.yml"
    path.write_text(text)
    problems = Problems()
    node = read_tree(path, problems).get("urdf_path")
    assert node is not None
    found = find_urdf(node, Reader(problems))
    return found, [str(problem).removeprefix(f"{path}") for problem in problems.errors]


def test_urdf_beside_configuration_is_found(folder: Path) -> None:
    assert find(folder, "urdf_path: urdf/robot.urdf") == (folder / "urdf" / "robot.urdf", [])


def test_urdf_relative_to_parent_folder_is_found(folder: Path) -> None:
    found, warnings = find(folder, "urdf_path: robot/urdf/robot.urdf")
    assert warnings == []
    assert found is not None
    assert found.samefile(folder / "urdf" / "robot.urdf")


def test_urdf_by_absolute_path_is_found(folder: Path, tmp_path: Path) -> None:
    assert find(folder, f"urdf_path: {folder}/urdf/robot.urdf")[0] == folder / "urdf" / "robot.urdf"


def test_missing_urdf_is_refused_with_suggestion(folder: Path) -> None:
    missing = f":1: urdf_path: there is no file {{}} in {folder} or in the folder above; did you mean urdf/robot.urdf"
    for written in ("urdf/robt.urdf", "something_else.urdf"):
        assert find(folder, f"urdf_path: {written}") == (None, [missing.format(written)])
    (folder / "other.xacro").touch()
    assert find(folder, "urdf_path: a.urdf")[1] == [missing.format("a.urdf").partition("; did")[0]]


@pytest.mark.parametrize("written", ["''", "1", "[a]", "{}", "", "true", '"a\\0b"', '"a\\nb"'])
def test_invalid_urdf_path_is_refused(written: str, folder: Path) -> None:
    found, (line,) = find(folder, f"urdf_path: {written}")
    assert found is None
    assert line.startswith(":1: urdf_path: must be the path of a URDF, xacro or MJCF file (got ")


def test_folder_or_overlong_name_as_urdf_path_is_refused(folder: Path) -> None:
    for written in ("urdf", "a" * 5000):
        (line,) = find(folder, f"urdf_path: {written}")[1]
        assert ":1: urdf_path: there is no file " in line


def test_configuration_without_urdf_path_is_refused_with_hint(folder: Path) -> None:
    path = folder / "vr_configs.yml"
    path.write_text("urdf_pth: a")
    with pytest.raises(
        DescriptionError, match="1: the required entry 'urdf_path' is missing; is urdf_pth a misspelling of it"
    ):
        read_robot_config(path, print)
