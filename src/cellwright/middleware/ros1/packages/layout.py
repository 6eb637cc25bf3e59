"""Packages and programs as files in a folder."""

from __future__ import annotations

from pathlib import Path

from cellwright.middleware.ros1.packages.packages import PackageFile, package_files

_PLAIN, _PROGRAM = 0o644, 0o755


def write_package(package: str, folder: Path, programs: Path) -> None:
    """Bring a package in a folder up to date.

    What is as it should be is left alone, so that nothing is built again for nothing. A file that says something else
    is kept beside under its name with a tilde; files that are not the package's own are not touched.

    Args:
        package: its name.
        folder: where its files go.
        programs: the folder that shells are given for `python`.
    """
    for path, file in package_files(package, programs).items():
        write_file(folder / path, file)


def write_file(path: Path, file: PackageFile) -> None:
    """Write a file unless it is there as it should be; another one in its place is kept with a tilde."""
    mode = _PROGRAM if file.is_program else _PLAIN
    if path.is_file():
        if path.read_bytes() == file.content:
            path.chmod(mode)
            return
        path.replace(path.with_name(f"{path.name}~"))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(file.content)
    path.chmod(mode)


def write_programs(folder: Path, python: Path) -> None:
    """Links for a shell: `python`, as programs of the time ask for, and `python3` are ROS's Python."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("python", "python3"):
        link = folder / name
        if link.is_symlink() and link.readlink() == python:
            continue
        link.unlink(missing_ok=True)
        link.symlink_to(python)
