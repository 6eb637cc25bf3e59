"""Command `cellwright cell new`."""

from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine


def test_new_cell_is_checked_without_warnings(cellwright: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    ran = cellwright("cell", "new", str(file))
    assert (ran.status, ran.out, ran.err) == (0, f"written: {file}\n", "")
    assert len(file.read_text().splitlines()) <= 40
    ran = cellwright("check", str(file))
    assert (ran.status, ran.out, ran.err) == (0, "ok\n", "")


def test_existing_file_is_never_overwritten(cellwright: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("mine")
    ran = cellwright("cell", "new", str(file))
    assert (ran.status, ran.err) == (2, f"error: {file}: exists already; give another name, or delete it\n")
    assert file.read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "reason"),
    [("mine.txt", "give a file whose name ends in .yaml"), ("no/mine.yaml", "cannot be written: No such file")],
)
def test_file_that_cannot_be_written_is_refused(
    name: str, reason: str, cellwright: CommandLine, tmp_path: Path
) -> None:
    ran = cellwright("cell", "new", str(tmp_path / name))
    assert ran.status == 2
    assert reason in ran.err
