"""Mesh files of a robot, and their search.

Robots are distributed in folders, with meshes beside the URDF or in a former ROS package.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cellwright.config.models.files import FileReference, ModelFileError
from cellwright.config.models.meshes import MAX_SIZE, read_mesh
from cellwright.config.robot.urdf_file import package_folders
from cellwright.util.pose import Vector3

MAX_TOTAL_BYTES = 50 << 20
"""Maximum total size of the meshes of one robot [bytes]."""


class MeshFinder:
    """Finder of mesh files by the references in a robot file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[str, Path | None] = {}
        self._bytes = 0
        self.missing: dict[str, str] = {}
        """Reason why each unusable mesh cannot be used, by its reference."""
        self.oversized: dict[str, float] = {}
        """Largest length [m] of each mesh that is too large for a robot, by its reference."""

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

    def check_length(self, reference: str, path: Path, scale: Vector3) -> None:
        """Record a mesh that is larger than any part may be: most likely its unit is not the metre."""
        vertices = read_mesh(path)[0]
        length = float(np.ptp(vertices * scale, axis=0).max())
        if length > MAX_SIZE:
            self.oversized[reference] = max(length, self.oversized.get(reference, 0.0))

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
        named = FileReference.read(reference)
        # Without a package, PyBullet, too, searches upwards folder by folder.
        above = self._path.resolve().parents
        for folder in above if named.package is None else package_folders(named.package, self._path):
            for path in named.paths:
                yield folder / path
