"""Convex pieces of a mesh, made by CoACD once and kept in the user's cache.

An entry of the cache is a list of its pieces with their checksums, and an STL file for each. Its name is a digest of
the mesh and of all that the pieces depend on, so an entry is never outdated. One that is damaged is made again.

CoACD runs in a process of its own: the number of its threads is fixed there when its library is loaded, and a mesh that
it cannot divide in time ends with the process.
"""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from cellwright.config.models.meshes import Triangles, read_mesh
from cellwright.util.errors import UsageError
from cellwright.util.files import user_folder, write_atomic
from cellwright.util.pose import Vector3

MAX_TIME = 900.0
"""Maximum time for the pieces of one mesh [s]; those of a link of a UR10 take up to 22 s of processor time."""
MAX_PIECES = 64
"""Maximum number of pieces of one mesh."""

_FORM = 1  # of the cache's entries
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_PROGRAM = """
import sys
import coacd
import numpy as np
threshold, max_pieces = float(sys.argv[2]), int(sys.argv[3])
with np.load(sys.argv[1] + "/mesh.npz") as mesh:
    whole = coacd.Mesh(mesh["vertices"], mesh["triangles"])
coacd.set_log_level("off")
# a third of the usual effort: links with holes take a minute and a half with all of it
effort = {"mcts_iterations": 50, "preprocess_resolution": 30}
found = coacd.run_coacd(whole, threshold=threshold, max_convex_hull=max_pieces, seed=0, **effort)
arrays = {f"{name}{number}": array for number, piece in enumerate(found) for name, array in zip("vt", piece)}
np.savez(sys.argv[1] + "/pieces.npz", **arrays)
"""


def convex_pieces(
    mesh: Path, scale: Vector3, threshold: float, variables: Mapping[str, str] = os.environ
) -> tuple[Path, ...]:
    """Return STL files with the convex pieces of a mesh, scaled [m]: from the cache, or made now.

    The same mesh and threshold yield the same pieces.

    Args:
        mesh: its file.
        scale: factors along its axes.
        threshold: concavity up to which a piece is not divided further, relative to the size of the mesh.
        variables: the environment, for the folder of the cache.

    Raises:
        UsageError: CoACD is not installed, cannot divide the mesh, or the cache cannot be written.
        ModelFileError: the mesh cannot be read.
    """
    try:
        maker = version("coacd")
    except PackageNotFoundError:
        raise UsageError(
            "collision: pieces need the package coacd; run: pip install 'cellwright[arms]', or take kind hull"
        ) from None
    vertices, triangles = read_mesh(mesh)
    whole = vertices * scale, triangles if np.prod(scale) > 0 else triangles[:, ::-1]
    entry = user_folder("XDG_CACHE_HOME", ".cache", variables) / "pieces" / _key(whole, threshold, maker)
    found = _kept(entry)
    if found:
        return found
    pieces = _divide(mesh, whole, threshold)
    try:
        entry.mkdir(parents=True, exist_ok=True)
        return _keep(entry, pieces)
    except OSError as error:
        reason = error.strerror or error
        raise UsageError(f"{entry}: cannot be written: {reason}; name another folder in XDG_CACHE_HOME") from None


def _key(mesh: Triangles, threshold: float, maker: str) -> str:
    digest = hashlib.sha256(f"{_FORM} {maker} {threshold!r} {MAX_PIECES} {_PROGRAM}\0".encode())
    vertices, triangles = mesh
    digest.update(f"{len(vertices)}\0".encode() + vertices.astype("<f8").tobytes() + triangles.astype("<i8").tobytes())
    return digest.hexdigest()[:32]


def _kept(entry: Path) -> tuple[Path, ...]:
    """Return the pieces in an entry of the cache; none if it is missing or damaged."""
    try:
        checksums = json.loads((entry / "pieces.json").read_bytes())["sha256"]
        paths = tuple(entry / f"piece_{number}.stl" for number in range(len(checksums) - 1))
        actual = [_checksum(path.read_bytes()) for path in paths]
    except (OSError, ValueError, KeyError, TypeError):
        return ()
    return paths if [*actual, _checksum("".join(actual).encode())] == checksums else ()


def _keep(entry: Path, pieces: list[Triangles]) -> tuple[Path, ...]:
    paths, checksums = [], []
    for number, piece in enumerate(pieces):
        content = _stl(piece)
        paths.append(entry / f"piece_{number}.stl")
        checksums.append(_checksum(content))
        write_atomic(paths[-1], content)
    # the list comes last, and its own checksum after those of the pieces: an entry is whole or none
    checksums.append(_checksum("".join(checksums).encode()))
    write_atomic(entry / "pieces.json", json.dumps({"sha256": checksums}))
    return tuple(paths)


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _divide(path: Path, mesh: Triangles, threshold: float) -> list[Triangles]:
    """Return the pieces of a mesh, which CoACD makes in a process of its own."""
    with tempfile.TemporaryDirectory(prefix="cellwright-pieces-") as folder:
        np.savez(Path(folder) / "mesh.npz", vertices=mesh[0], triangles=mesh[1].astype(np.int32))
        command = [sys.executable, "-P", "-c", _PROGRAM, folder, repr(threshold), str(MAX_PIECES)]
        try:
            # more threads wait for each other on a busy machine, without end
            done = subprocess.run(  # noqa: S603 - our own interpreter and program
                command,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                timeout=MAX_TIME,
                check=False,
            )
        except subprocess.TimeoutExpired:
            remedy = "simplify the mesh, raise the threshold, or take kind hull"
            raise UsageError(f"{path}: CoACD takes longer than {MAX_TIME:g} s for its pieces; {remedy}") from None
        try:
            with np.load(Path(folder) / "pieces.npz") as found:
                count = len(found.files) // 2
                pieces = [(found[f"v{number}"], found[f"t{number}"].astype(np.int64)) for number in range(count)]
        except (OSError, ValueError):
            pieces = []
    if not pieces:
        last = (done.stderr.decode(errors="replace").strip().splitlines() or [f"status {done.returncode}"])[-1]
        raise UsageError(f"{path}: CoACD makes no pieces of it ({last:.200}); repair the mesh, or take kind hull")
    return pieces


def _stl(mesh: Triangles) -> bytes:
    vertices, triangles = mesh
    facets = np.zeros(len(triangles), _FACET)
    facets["corners"] = vertices[triangles]
    return bytes(80) + len(facets).to_bytes(4, "little") + facets.tobytes()
