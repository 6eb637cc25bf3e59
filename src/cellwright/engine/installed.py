"""Check of the installed engine: its files must be those of the package `mujoco-core`.

The package `mujoco` owns the same folder. pip lets each of them write over the other's files, and its own check finds
no fault: runs would then have other results.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
from importlib.machinery import PathFinder
from types import ModuleType

from cellwright.util.errors import InstallationError

NAME = "mujoco"
"""The package in Python that two distributions install."""

RUNS_ON = ">=4.0.1,<5"
"""Versions of mujoco-core that Cellwright runs on."""

_SPLIT = (4,)
"""Version of `mujoco` that left its libraries to mujoco-core; those of older ones stay in the folder, and fail."""
_METADATA = re.compile(r"(mujoco|mujoco[_-]core)-([^-]+)\.dist-info")
_RECORDED = re.compile(rb"^mujoco/__init__\.py,sha256=([\w-]+)", re.MULTILINE)


def check_files(file: str | None = None) -> None:
    """Check, before it is loaded, that the engine's folder belongs to mujoco-core alone.

    Metadata that lies elsewhere, or does not exist, is not compared; see `check_loaded`.

    Args:
        file: path of the engine's `__init__.py`; None for the one that an import would load.

    Raises:
        InstallationError: another package wrote over the files, removed them, or left old libraries beside them.
    """
    if file is None:
        spec = PathFinder.find_spec(NAME)
        if spec is None:  # another finder may have it
            return
        file = spec.origin
        if file is None:
            raise InstallationError(f"{NAME}: files of the engine are missing (got a folder without them); {_cure()}")
    site = os.path.dirname(os.path.dirname(os.path.abspath(file)))
    found = [match for match in map(_METADATA.fullmatch, os.listdir(site)) if match]
    digests = {match[2]: _recorded(os.path.join(site, match[0])) for match in found if match[1] != NAME}
    if not any(digests.values()):
        return
    others = [match[2] for match in found if match[1] == NAME]
    with open(file, "rb") as opened:
        digest = base64.urlsafe_b64encode(hashlib.sha256(opened.read()).digest()).rstrip(b"=")
    if digest not in digests.values() or any(_numbers(other) < _SPLIT for other in others):
        version = max(digests)
        got = " and ".join(f"{NAME} {other}" for other in others) or "files of an unknown package"
        raise InstallationError(
            f"{NAME}: another package writes to the folder of mujoco-core {version} (got {got}); {_cure(version)}"
        )


def check_loaded(mujoco: ModuleType) -> None:
    """Check that the loaded engine is one that Cellwright runs on, and that mujoco-core installed it.

    Raises:
        InstallationError: it is of another version or package.
    """
    python, library = str(mujoco.__version__), str(mujoco.mj_versionString())
    if not _runs_on(python) or library != python:
        got = f"{NAME} {python}" if library == python else f"{NAME} {python} with the library {library}"
        raise InstallationError(f"{NAME}: Cellwright needs the engine of mujoco-core {RUNS_ON} (got {got}); {_cure()}")
    if mujoco.__file__ is not None:
        check_files(mujoco.__file__)


def _recorded(metadata: str) -> bytes:
    """Return the digest of `__init__.py` as installed; empty where the package's list of files is not known."""
    try:
        with open(os.path.join(metadata, "RECORD"), "rb") as opened:
            line = _RECORDED.search(opened.read())
    except OSError:
        return b""
    return line[1] if line else b""


def _cure(version: str = "") -> str:
    """Return the command that puts the folder right; to install mujoco-core again would leave old libraries in it."""
    wanted = f"=={version}" if _runs_on(version) else RUNS_ON
    return f'run: pip uninstall -y mujoco mujoco-core && pip install "mujoco-core{wanted}"'


def _runs_on(version: str) -> bool:
    first, end = map(_numbers, RUNS_ON.split(","))
    return first <= _numbers(version) < end


def _numbers(version: str) -> tuple[int, ...]:
    """Return the numbers of a version or of a bound: (4, 0, 1) for "4.0.1", "4.0.1rc1" and ">=4.0.1"."""
    return tuple(int(number) for number in re.findall(r"(?:^\D*|\.)(\d+)", version))
