"""Tree: a folder with everything that a shell needs to use ROS's tools on a cell, and the shell's variables.

- share/    the packages, and stubs of packages that ROS's tools would not see   -> ROS_PACKAGE_PATH
- python/   modules of messages, and ariac_example                              -> PYTHONPATH
- bin/      python and python3: the interpreter that has ROS                    -> PATH
- .catkin   makes it a workspace for catkin_find                                -> CMAKE_PREFIX_PATH

Debian has the definitions of standard messages in packages without a manifest, unless their C++ files are installed
too. Then `rosmsg show std_msgs/String` finds no such package. A manifest beside a link to the definitions is enough.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from subprocess import PIPE

from cellwright._package import VERSION
from cellwright.middleware.ros1.host.installation import RosSystem, tool_environment
from cellwright.middleware.ros1.packages import contents
from cellwright.util.errors import UsageError
from cellwright.util.files import user_folder

_WORKSPACE = ".catkin"
"""Mark of a folder that catkin searches; an empty one names no sources."""

_TIMEOUT = 120.0  # timeout of one generator [s]
STUB_MANIFEST = """<?xml version="1.0"?>
<package format="2">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Stands in for the manifest of the definitions in {source}.</description>
  <maintainer email="cellwright@example.com">The Cellwright project</maintainer>
  <license>BSD</license>
</package>
"""


def cache_folder(variables: Mapping[str, str] = os.environ) -> Path:
    """Return the default folder of trees."""
    return user_folder("XDG_CACHE_HOME", ".cache", variables) / "ros1"


def ensure_tree(ros: RosSystem, folder: Path) -> Path:
    """Return the tree of this version of Cellwright on this machine; create it in a folder if it is missing.

    Its name has the version and a digest of all its sources, so a tree is never stale. It appears completely or not at
    all, and concurrent calls do not interfere.

    Raises:
        UsageError: the folder cannot be written, or a generator failed.
    """
    tree = folder.absolute() / f"{VERSION}-{_digest(ros)}"
    if tree.is_dir():
        return tree
    try:
        tree.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".new-", dir=tree.parent) as name:
            new = Path(name) / tree.name
            _make(ros, new, tree)
            try:
                new.rename(tree)
            except OSError:
                if not tree.is_dir():  # else another process was faster
                    raise
    except OSError as error:
        raise UsageError(f"{folder}: cannot write ROS packages: {error.strerror or error}") from None
    return tree


def _make(ros: RosSystem, new: Path, tree: Path) -> None:
    share, modules = new / "share", new / "python"
    ours = contents.provided_packages(ros)
    for name in ours:
        contents.write_package(name, share / name, tree / "bin")
    write_stubs(ros.share, share)
    generate_modules(ros, share, [name for name in contents.MESSAGE_PACKAGES if name in ours], modules)
    shutil.copytree(share / "ariac_example" / "src" / "ariac_example", modules / "ariac_example")
    contents.write_programs(new / "bin", ros.python)
    (new / _WORKSPACE).touch()


def _digest(ros: RosSystem) -> str:
    """Return a digest of all sources of a tree."""
    digest = hashlib.sha256()
    for item in (_WORKSPACE, ros.prefix, ros.python, ros.python.resolve(), *packages_without_manifest(ros.share)):
        digest.update(f"{item}\0".encode())
    for package in contents.provided_packages(ros):
        digest.update(f"{package}\0".encode())
        for path, content in contents.package_files(package, Path("bin")).items():
            digest.update(f"{path} {len(content)}\0".encode() + content)
    return digest.hexdigest()[:12]


def variables(tree: Path, ros: RosSystem, present: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return a shell's variables with the tree in front; earlier trees are removed."""

    def with_tree(name: str, part: str, otherwise: str = "") -> str:
        entries = (present.get(name) or otherwise).split(os.pathsep)
        kept = [entry for entry in entries if entry and not _is_of_a_tree(entry, tree.parent, part)]
        return os.pathsep.join([str(tree / part), *kept])

    return {
        "CMAKE_PREFIX_PATH": with_tree("CMAKE_PREFIX_PATH", "", str(ros.prefix)),
        "ROS_PACKAGE_PATH": with_tree("ROS_PACKAGE_PATH", "share", str(ros.share)),
        "PYTHONPATH": with_tree("PYTHONPATH", "python"),
        "PATH": with_tree("PATH", "bin", os.defpath),
    }


def _is_of_a_tree(entry: str, folder: Path, part: str) -> bool:
    path = Path(entry)
    return (path.parent.parent == folder and path.name == part) if part else path.parent == folder


def generate_modules(ros: RosSystem, packages: Path, names: Sequence[str], modules: Path) -> None:
    """Write the modules of packages (`from osrf_gear.msg import Order`) to a folder for Python's path.

    Raises:
        UsageError: a generator failed; the error has its last line.
    """
    search = [f"-I{name}:{packages / name / 'msg'}" for name in names]
    search += [f"-I{folder.parent.name}:{folder}" for folder in sorted(ros.share.glob("*/msg")) if folder.is_dir()]
    environment = tool_environment(ros)
    running = [
        (command, subprocess.Popen(command, env=environment, stdout=PIPE, stderr=PIPE, text=True))  # noqa: S603
        for name in names
        for command in _generator_commands(ros, packages / name, modules / name, search)
    ]
    finished = [(command, process, *process.communicate(timeout=_TIMEOUT)) for command, process in running]
    for command, process, out, error in finished:
        if process.returncode != 0:
            last = ((error or out).strip().splitlines() or ["without output"])[-1]
            raise UsageError(f"{Path(command[1]).name} failed for {command[-1]}: {last}")
    for name in names:
        (modules / name / "__init__.py").touch()
        for namespace in ("msg", "srv"):
            folder = modules / name / namespace
            if folder.is_dir():
                stems = sorted(path.stem for path in folder.glob("_*.py") if path.stem != "__init__")
                lines = "".join(f"from .{stem} import *\n" for stem in stems)
                (folder / "__init__.py").write_text(lines, encoding="utf-8")


def _generator_commands(ros: RosSystem, package: Path, modules: Path, search: Sequence[str]) -> Iterator[list[str]]:
    for namespace in ("msg", "srv"):
        definitions = sorted(map(str, (package / namespace).glob(f"*.{namespace}")))
        if definitions:
            out = modules / namespace
            out.mkdir(parents=True, exist_ok=True)
            program = str(ros.generators / f"gen{namespace}_py.py")
            yield [str(ros.python), program, *definitions, *search, "-p", package.name, "-o", str(out)]


def packages_without_manifest(share: Path) -> list[str]:
    """Return the packages in a folder that define messages or services and have no manifest, sorted."""
    folders = {
        path.parent for kind in ("msg", "srv") for path in share.glob(f"*/{kind}") if any(path.glob(f"*.{kind}"))
    }
    return sorted(folder.name for folder in folders if not (folder / "package.xml").exists())


def write_stubs(share: Path, packages: Path) -> list[str]:
    """Write a stub in the folder `packages` for each package of `share` without a manifest; return their names."""
    names = packages_without_manifest(share)
    for name in names:
        stub = packages / name
        stub.mkdir(parents=True)
        (stub / "package.xml").write_text(STUB_MANIFEST.format(name=name, source=share / name), encoding="utf-8")
        for kind in ("msg", "srv"):
            if (share / name / kind).is_dir():
                (stub / kind).symlink_to(share / name / kind)
    return names
