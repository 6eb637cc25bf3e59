"""Mesh files of a robot: search, and the text of a URDF with their absolute paths.

Robots are distributed in folders, with meshes beside the URDF or in a former ROS package. Programs that get only the
text, such as rviz, find neither.
"""

import re
from collections.abc import Iterator
from html import escape, unescape
from pathlib import Path
from urllib.parse import unquote

from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import read_mesh
from cellwright.config.robot.urdf_file import package_folders

MAX_TOTAL_BYTES = 50 << 20
"""Maximum total size of the meshes of one robot [bytes]."""

_SCHEME = re.compile(r"(package|model)://([^/]+)/(.+)")


class MeshFinder:
    """Finder of mesh files by the references in a robot file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[str, Path | None] = {}
        self._bytes = 0
        self.missing: dict[str, str] = {}
        """Reason why each unusable mesh cannot be used, by its reference."""

    def find(self, reference: str) -> Path | None:
        """Return the file of a mesh; None if there is no usable one, which is recorded in `missing`."""
        if reference not in self._found:
            self._found[reference] = None
            try:
                self._found[reference] = self._usable(reference)
            except ModelFileError as error:
                self.missing[reference] = str(error)
            except (OSError, ValueError) as error:
                self.missing[reference] = f"cannot be read: {error}"
        return self._found[reference]

    def locate(self, reference: str) -> Path | None:
        """Return the path of a mesh file, usable or not; None if there is none."""
        try:
            return next((place for place in self._places(reference) if place.is_file()), None)
        except (OSError, ValueError):
            return None

    def _usable(self, reference: str) -> Path:
        path = next((place for place in self._places(reference) if place.is_file()), None)
        if path is None:
            raise ModelFileError("not found")
        size = path.stat().st_size
        if self._bytes + size > MAX_TOTAL_BYTES:
            raise ModelFileError(f"the meshes of the robot exceed {MAX_TOTAL_BYTES >> 20} MiB in total")
        try:
            read_mesh(path)
        except ModelFileError as error:
            raise ModelFileError(str(error).removeprefix(f"{path}: ")) from None
        self._bytes += size
        return path

    def _places(self, reference: str) -> Iterator[Path]:
        """Yield the candidate paths of a mesh, the likeliest first."""
        if scheme := _SCHEME.match(reference):
            package, rest = scheme[2], unquote(scheme[3])
            for folder in package_folders(package, self._path):
                yield folder / rest
            return
        name = unquote(reference.removeprefix("file://")) if reference.startswith("file://") else reference
        for folder in self._path.resolve().parents:  # PyBullet, too, searches upwards folder by folder
            yield folder / name.replace("\\", "/")


_MESH = re.compile(r"""(<mesh\b[^>]*?\bfilename\s*=\s*)(["'])(.*?)\2""", re.DOTALL)


def with_absolute_meshes(text: str, path: Path) -> str:
    """Return the text of the URDF at a path with the absolute path of each mesh file that exists on this machine.

    Missing meshes stay as written, and so do those of real packages, which ROS finds on other machines too.
    """
    finder = MeshFinder(path)

    def replace(match: re.Match[str]) -> str:
        found = finder.locate(unescape(match[3]))
        if found is None:
            return match[0]
        if match[3].startswith("package://") and any((folder / "package.xml").is_file() for folder in found.parents):
            return match[0]
        return f"{match[1]}{match[2]}{escape(found.resolve().as_uri())}{match[2]}"

    return _MESH.sub(replace, text)
