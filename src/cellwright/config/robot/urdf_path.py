"""Finds the URDF that a robot configuration names."""

from __future__ import annotations

from pathlib import Path

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Leaf, Table, described
from cellwright.util.errors import did_you_mean

_NEARBY = tuple(f"{levels}*.{suffix}" for levels in ("", "*/", "*/*/") for suffix in ("urdf", "xacro"))


def find_urdf(root: Table, path: Path, reader: Reader) -> Path | None:
    """The URDF; its path counts from the folder of the configuration, or, as in old revisions, from the one above.

    Args:
        root: the top level of the configuration.
        path: the configuration's file.
        reader: takes what is wrong.
    """
    node = reader.required(root, "urdf_path")
    if node is None:
        return None
    if not isinstance(node, Leaf) or not isinstance(node.value, str) or not node.value.isprintable() or not node.value:
        reader.problems.error(node, f"must be the path of a URDF or xacro file, not {described(node)}")
        return None
    folder = path.parent
    for found in (folder / node.value, folder.parent / node.value):
        try:
            if found.is_file():
                return found
        except OSError:  # a name too long for the file system, or a folder that may not be looked into
            break
    reader.problems.error(
        node,
        f"there is no file {node.value} in {folder.absolute()}, nor in the folder above{_close(node.value, folder)}",
    )
    return None


def _close(name: str, folder: Path) -> str:
    """A remark with a URDF in the folder that has a name like this one, or the only one that there is."""
    try:
        found = [str(path.relative_to(folder)) for pattern in _NEARBY for path in folder.glob(pattern)]
    except OSError:
        return ""
    return did_you_mean(name, found) or (f"; did you mean {found[0]}" if len(found) == 1 else "")
