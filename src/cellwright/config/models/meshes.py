"""Mesh reader: STL (binary or text), the triangles of Wavefront OBJ, and DAE (COLLADA) with its colours."""

import re
import stat
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.config.models.dae import joined, read_dae
from cellwright.config.models.files import MAX_ASSET_BYTES, ModelFileError
from cellwright.config.models.model import Surface
from cellwright.config.parsing.sources import note_source, read_at_most, reason
from cellwright.util.files import LFS_POINTER, is_lfs_pointer

Triangles: TypeAlias = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices, shape (n, 3), in the file's units, and triangles as vertex indices, shape (m, 3)."""

MAX_TRIANGLES = 400_000
"""Maximum number of triangles of a mesh."""
MAX_SIZE = 20.0
"""Maximum length of a mesh [m]; of a longer one the unit is most likely the millimetre."""
MAX_COORDINATE = 1e9
"""Maximum coordinate, in the file's units; a file with larger ones is broken."""

_SUFFIXES = (".stl", ".obj", ".dae")
_Mesh: TypeAlias = tuple[Triangles, tuple[Surface, ...]]
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84
_CONTINUED = re.compile(rb"\\[ \t]*\r?\n")


def read_mesh(path: Path) -> Triangles:
    """Return the mesh in a file; a DAE file's lengths are in metres.

    Raises:
        ModelFileError: the file has no usable mesh.
    """
    return _read(path)[0]


def read_surfaces(path: Path) -> tuple[Surface, ...]:
    """Return the surfaces of the mesh in a file, one for each colour that the file gives.

    Only a DAE file gives any: the mesh of an STL or OBJ file is one surface without a colour.

    Raises:
        ModelFileError: the file has no usable mesh.
    """
    return _read(path)[1]


def _read(path: Path) -> _Mesh:
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise ModelFileError(f"{path}: must be an .stl, .obj or .dae file; convert the mesh")
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode):
            raise ModelFileError(f"{path}: not a regular file")
        # the cache may hold the mesh already
        note_source(path)
    except FileNotFoundError:
        raise ModelFileError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise ModelFileError(f"{path}: cannot be read: {reason(error)}") from None
    return _read_file(path, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=16)
def _read_file(path: Path, _changed: int, _size: int) -> _Mesh:
    """Implement `_read`, cached: a file that a hundred shapes refer to is read once while it stays unchanged."""
    try:
        content = read_at_most(path, MAX_ASSET_BYTES)
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read: {error.strerror}") from None
    if content is None:
        raise ModelFileError(f"{path}: larger than {MAX_ASSET_BYTES >> 20} MiB")
    if is_lfs_pointer(content):
        raise ModelFileError(f"{path}: {LFS_POINTER}")
    suffix = path.suffix.lower()
    try:
        # NaN and infinity are refused below, in one line
        with np.errstate(all="ignore"):
            if suffix == ".dae":
                surfaces = read_dae(content, MAX_TRIANGLES)
            else:
                surfaces = (Surface(*(_stl(content) if suffix == ".stl" else _obj(content))),)
    except ModelFileError as error:
        raise ModelFileError(f"{path}: {error}") from None
    except (ValueError, IndexError, OverflowError):
        raise ModelFileError(f"{path}: invalid {path.suffix[1:].upper()} file") from None
    vertices, triangles = joined(surfaces)
    _check(path, vertices, triangles)
    for array in (vertices, triangles, *(array for each in surfaces for array in (each.vertices, each.triangles))):
        array.flags.writeable = False  # the cache returns them again
    return (vertices, triangles), surfaces


def is_flat(vertices: NDArray[np.float64]) -> bool:
    """Return whether vertices [m], shape (n, 3), lie in a plane within 10 um."""
    spread = np.linalg.svd(vertices - vertices.mean(axis=0), compute_uv=False)
    return len(vertices) < 4 or bool(spread[-1] < 1e-5 * np.sqrt(len(vertices)))


def _check(path: Path, vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> None:
    if not len(triangles):
        raise ModelFileError(f"{path}: the mesh has no triangles")
    if len(triangles) > MAX_TRIANGLES:
        raise ModelFileError(f"{path}: too many triangles (got {len(triangles)}, at most {MAX_TRIANGLES})")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise ModelFileError(f"{path}: a triangle refers to a missing vertex")
    if not np.isfinite(vertices).all():
        raise ModelFileError(f"{path}: a coordinate is not a finite number")
    if np.abs(vertices).max() > MAX_COORDINATE:
        raise ModelFileError(f"{path}: coordinates must be within ±{MAX_COORDINATE:g}")


def _stl(content: bytes) -> Triangles:
    """Read an STL file; bytes behind the triangles of a binary one are ignored."""
    count, length = int.from_bytes(content[80:_HEADER], "little"), len(content) - _HEADER
    # a binary header has a 0 in its count
    if length != count * _FACET.itemsize and b"\0" not in content[:_HEADER]:
        words = [line.split() for line in content.splitlines()]
        rows = [_vertex(line) for line in words if line and line[0].lower() == b"vertex"]
        corners = np.array(rows, np.float64).reshape(-1, 3, 3)
    elif length < count * _FACET.itemsize:
        raise ModelFileError(f"cut short, with {max(length, 0) // _FACET.itemsize} of {count} triangles")
    else:
        corners = np.frombuffer(content, _FACET, count, _HEADER)["corners"].astype(np.float64)
    return _merged(corners.reshape(-1, 3))


def _merged(corners: NDArray[np.float64]) -> Triangles:
    """Merge equal corners (3 m, 3), three per triangle, into triangles of distinct vertices."""
    order = np.lexsort(corners.T[::-1])
    in_order = corners[order]
    is_new = np.ones(len(order), bool)
    is_new[1:] = (in_order[1:] != in_order[:-1]).any(axis=1)
    numbers = np.empty(len(order), np.int64)
    numbers[order] = np.cumsum(is_new) - 1
    return in_order[is_new], numbers.reshape(-1, 3)


def _obj(content: bytes) -> Triangles:
    """Read the triangles of an OBJ file: a backslash continues a line, and `#` begins a comment."""
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for line in _CONTINUED.sub(b" ", content.rstrip(b"\0\x1a")).splitlines():
        if line.startswith((b"vn", b"vt")):  # half of many files
            continue
        words = line.partition(b"#")[0].split()
        kind = words[0] if words else b""
        if kind == b"v":
            vertices.append(_vertex(words))
        elif kind == b"f":
            count = len(vertices)
            corners = [_corner(int(word.partition(b"/")[0]), count) for word in words[1:]]
            if len(corners) == 3:
                triangles.append((corners[0], corners[1], corners[2]))
            else:
                triangles += [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
    return np.array(vertices, np.float64).reshape(-1, 3), np.array(triangles, np.int64).reshape(-1, 3)


def _corner(number: int, count: int) -> int:
    """Return the index of a vertex that OBJ counts from 1, or backwards from the last one of `count` so far."""
    if number == 0:
        raise ValueError("vertices are counted from 1")
    return number - 1 if number > 0 else count + number


def _vertex(words: list[bytes]) -> list[float]:
    """Return the three numbers behind the first word of a line; further ones are colours and weights."""
    numbers = [float(word) for word in words[1:4]]
    if len(numbers) != 3:
        raise ValueError(f"a vertex must have 3 numbers (got {len(numbers)})")
    return numbers
