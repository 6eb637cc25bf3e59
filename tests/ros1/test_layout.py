"""Package files: written only when necessary, and no user's changes are lost."""

import os
from pathlib import Path

from cellwright.middleware.ros1.packages.contents import package_files, write_package, write_programs


def test_write_package_writes_all_files(tmp_path: Path) -> None:
    write_package("osrf_gear", tmp_path / "osrf_gear", tmp_path / "bin")
    expected = package_files("osrf_gear", tmp_path / "bin")
    there = {path.relative_to(tmp_path / "osrf_gear").as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert there == expected.keys()
    assert os.access(tmp_path / "osrf_gear" / "script" / "gear.py", os.X_OK)
    assert not os.access(tmp_path / "osrf_gear" / "package.xml", os.X_OK)


def test_write_package_leaves_unchanged_files(tmp_path: Path) -> None:
    write_package("cellwright_msgs", tmp_path, tmp_path)
    manifest = tmp_path / "package.xml"
    os.utime(manifest, (1.0, 1.0))
    write_package("cellwright_msgs", tmp_path, tmp_path)
    assert manifest.stat().st_mtime == 1.0
    assert not list(tmp_path.rglob("*~"))


def test_write_package_keeps_changed_file_with_tilde(tmp_path: Path) -> None:
    write_package("cellwright_msgs", tmp_path, tmp_path)
    (tmp_path / "package.xml").write_text("mine")
    (tmp_path / "notes.txt").write_text("mine too")
    write_package("cellwright_msgs", tmp_path, tmp_path)
    assert (tmp_path / "package.xml~").read_text() == "mine"
    assert (tmp_path / "notes.txt").read_text() == "mine too"
    assert (tmp_path / "package.xml").read_bytes() == package_files("cellwright_msgs", tmp_path)["package.xml"]


def test_write_programs_links_python_to_python_of_ros(tmp_path: Path) -> None:
    folder = tmp_path / "bin"
    write_programs(folder, Path("/usr/bin/python3.1"))
    write_programs(folder, Path("/usr/bin/python3"))
    assert {path.name: path.readlink() for path in folder.iterdir()} == {
        "python": Path("/usr/bin/python3"),
        "python3": Path("/usr/bin/python3"),
    }
