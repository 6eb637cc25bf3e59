"""How a URDF refers to its meshes, made such that programs elsewhere find them.

Robots are passed on in folders, with meshes beside the URDF or in what was once a package. Programs that are given the
text alone, such as rviz, find neither.
"""

from __future__ import annotations

import re
from html import escape, unescape
from pathlib import Path

from cellwright.config.robot.meshes import MeshFinder

_MESH = re.compile(r"""(<mesh\b[^>]*?\bfilename\s*=\s*)(["'])(.*?)\2""", re.DOTALL)
_MANIFEST = "package.xml"
_PACKAGE = "package://"


def with_absolute_meshes(text: str, path: Path) -> str:
    """The text of a URDF with the address of each mesh file that is found on this machine.

    What stays as it is: meshes that are not found, and those of real packages, which ROS finds on other machines too.

    Args:
        text: of the URDF.
        path: where the URDF is; meshes are looked for from there.
    """
    finder = MeshFinder(path)

    def replace(match: re.Match[str]) -> str:
        found = finder.locate(unescape(match[3]))
        if found is None or (match[3].startswith(_PACKAGE) and _is_in_package(found)):
            return match[0]
        return f"{match[1]}{match[2]}{escape(found.resolve().as_uri())}{match[2]}"

    return _MESH.sub(replace, text)


def _is_in_package(file: Path) -> bool:
    return any((folder / _MANIFEST).is_file() for folder in file.parents)
