"""A folder with everything that a shell needs to use ROS's tools on a cell, and the lines that put it on the paths.

share/    the packages, and stubs of packages that ROS's tools would not see   -> ROS_PACKAGE_PATH
python/   modules of messages, and ariac_example                              -> PYTHONPATH
bin/      python and python3: the interpreter that has ROS                    -> PATH
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from cellwright._package import VERSION
from cellwright.middleware.ros1.packages.contents import MESSAGE_PACKAGES, package_files, write_package, write_programs
from cellwright.middleware.ros1.packages.tools import (
    RosSystem,
    generate_modules,
    packages_without_manifest,
    provided_packages,
    write_stubs,
)
from cellwright.util.errors import UsageError

SHELLS = ("sh", "fish")  # whose language the lines are in; bash and zsh understand `sh` as well


def cache_folder(variables: Mapping[str, str] = os.environ) -> Path:
    """Where trees are kept if nobody says otherwise."""
    base = variables.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "cellwright" / "ros1"


def ensure_tree(ros: RosSystem, folder: Path) -> Path:
    """The tree of this version of Cellwright on this machine, made in a folder if it is not there yet.

    Its name carries the version and a digest of all that it is made of, so a tree is never stale. It appears whole or
    not at all, and two that are made at once do not harm each other.

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
                if not tree.is_dir():  # else somebody else was faster
                    raise
    except OSError as error:
        raise UsageError(f"{folder}: ROS packages cannot be laid out here: {error.strerror or error}") from None
    return tree


def _make(ros: RosSystem, new: Path, tree: Path) -> None:
    share, modules = new / "share", new / "python"
    ours = provided_packages(ros)
    for name in ours:
        write_package(name, share / name, tree / "bin")
    write_stubs(ros.share, share)
    generate_modules(ros, share, [name for name in MESSAGE_PACKAGES if name in ours], modules)
    shutil.copytree(share / "ariac_example" / "src" / "ariac_example", modules / "ariac_example")
    write_programs(new / "bin", ros.python)


def _digest(ros: RosSystem) -> str:
    """A digest of everything that a tree is made of."""
    digest = hashlib.sha256()
    for item in (ros.prefix, ros.python, ros.python.resolve(), *packages_without_manifest(ros.share)):
        digest.update(f"{item}\0".encode())
    for package in provided_packages(ros):
        digest.update(f"{package}\0".encode())
        for path, content in package_files(package, Path("bin")).items():
            digest.update(f"{path} {len(content)}\0".encode() + content)
    return digest.hexdigest()[:12]


def variables(tree: Path, ros: RosSystem, present: Mapping[str, str] = os.environ) -> dict[str, str]:
    """What a shell's variables are to be, with the tree in front; trees that were there before are left out."""

    def with_tree(name: str, part: str, otherwise: str = "") -> str:
        entries = (present.get(name) or otherwise).split(os.pathsep)
        kept = [entry for entry in entries if entry and not _is_of_a_tree(entry, tree.parent)]
        return os.pathsep.join([str(tree / part), *kept])

    return {
        "ROS_PACKAGE_PATH": with_tree("ROS_PACKAGE_PATH", "share", str(ros.share)),
        "PYTHONPATH": with_tree("PYTHONPATH", "python"),
        "PATH": with_tree("PATH", "bin", os.defpath),
    }


def _is_of_a_tree(entry: str, folder: Path) -> bool:
    path = Path(entry)
    return path.parent.parent == folder and path.name in ("share", "python", "bin")


def shell_lines(values: Mapping[str, str], shell: str) -> str:
    """Lines that set variables, for one of `SHELLS` to evaluate."""
    lines = []
    for name, value in values.items():
        if shell == "fish":
            parts = value.split(os.pathsep) if name == "PATH" else [value]
            quoted = ("'" + part.replace("\\", "\\\\").replace("'", "\\'") + "'" for part in parts)
            lines.append(" ".join(["set -gx", name, *quoted]))
        else:
            lines.append(f"export {name}={shlex.quote(value)}")
    return "\n".join(lines)
