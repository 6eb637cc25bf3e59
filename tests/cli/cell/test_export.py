"""Command `cellwright cell export`."""

from pathlib import Path

import mujoco
import pytest

from tests.cell.arm_cells import ARMS, PEDESTAL, TWO_UR5
from tests.cli.conftest import CommandLine


@pytest.fixture
def cell(tmp_path: Path) -> str:
    (tmp_path / "cell.yaml").write_text(PEDESTAL.format(model=ARMS / "ur5.urdf"))
    return "cell.yaml"


def test_package_is_named_as_its_folder_and_keeps_what_was_changed(
    cellwright: CommandLine, cell: str, tmp_path: Path
) -> None:
    ran = cellwright("cell", "export", cell, "--moveit", "ws/src/small_cell")
    assert (ran.status, ran.out) == (0, "written: ws/src/small_cell\n")
    folder = tmp_path / "ws" / "src" / "small_cell"
    assert "<name>small_cell</name>" in (folder / "package.xml").read_text()
    limits = folder / "config" / "joint_limits.yaml"
    written = limits.read_text()
    limits.write_text("mine")
    assert cellwright("cell", "export", cell, "--moveit", "ws/src/small_cell").status == 0
    assert (limits.read_text(), limits.with_name("joint_limits.yaml~").read_text()) == (written, "mine")


def test_model_of_the_engine_is_written(cellwright: CommandLine, cell: str, tmp_path: Path) -> None:
    ran = cellwright("cell", "export", cell, "--mjcf", "cell.xml")
    assert (ran.status, ran.out) == (0, "written: cell.xml\n")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "cell.xml")).nu > 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "nothing to write; give --moveit FOLDER or --mjcf FILE"),
        (("--mjcf", "cell.yml"), "--mjcf cell.yml: give a file whose name ends in .xml"),
        (("--mjcf", "no/cell.xml"), "--mjcf no/cell.xml: there is no folder no"),
        (
            ("--moveit", "My-Cell"),
            "--moveit My-Cell: a package is named in small letters, digits and underscores (got 'My-Cell')",
        ),
        (("--moveit", "taken"), "--moveit taken: is not a folder"),
        (("--moveit", "taken/package"), "--moveit taken/package: cannot be written: Not a directory"),
    ],
)
def test_what_cannot_be_written_is_refused(
    words: tuple[str, ...], message: str, cellwright: CommandLine, cell: str, tmp_path: Path
) -> None:
    (tmp_path / "taken").touch()
    ran = cellwright("cell", "export", cell, *words)
    assert (ran.status, ran.err.splitlines()[-1]) == (2, f"error: {message}")


def test_arm_with_other_names_is_refused_with_its_line(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "pair.yaml").write_text(TWO_UR5.format(model=ARMS / "ur5.urdf"))
    ran = cellwright("cell", "export", "pair.yaml", "--moveit", "pair")
    assert ran.status == 2
    assert "error: pair.yaml:4: cell.arms.arm1.names: MoveIt needs the names" in ran.err
    assert not (tmp_path / "pair").exists()


def test_cell_without_arm_is_refused_for_moveit(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "bare.yaml").write_text("cell: {bins: {bin1: {at: [0, 0], size: [0.5, 0.4], surface: 0.5}}}")
    ran = cellwright("cell", "export", "bare.yaml", "--moveit", "bare_config")
    assert ran.status == 2
    assert ran.err.endswith("bare has no arm to plan for; add one under cell: arms:\n")
    assert not (tmp_path / "bare_config").exists()
    assert cellwright("cell", "export", "bare.yaml", "--mjcf", "bare.xml").status == 0
