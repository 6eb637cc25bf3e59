"""Looks through a file in the engine's own format, MJCF, before the engine sees it.

The engine allocates and computes whatever a file asks for: one line can ask for all the memory there is, or an hour.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from cellwright.config.models.files import MAX_ASSET_BYTES, ModelFile, ModelFileError, beside

MOST_GEOMS = 200
"""Most shapes of one model."""
MAX_TOTAL_BYTES = 50 << 20
"""Largest meshes and pictures of one file together [bytes]."""
LARGEST_NUMBER = 4096
"""Largest number of what a file has room made for: users' values, a picture's width and height in pixels, …."""

_NOT_READ = (
    *("include", "model", "attach", "plugin", "extension"),
    *("flexcomp", "composite", "flex", "skin", "hfield", "replicate", "keyframe"),
)
_MEASURED = ("size", "texture")


def check_mjcf(file: ModelFile) -> None:
    """Refuse what an MJCF file could reach out of its folder with, and what is no rigid body.

    Raises:
        ModelFileError: such a thing is in it.
    """
    if (shapes := sum(1 for _ in file.root.iter("geom"))) > MOST_GEOMS:
        raise ModelFileError(f"{file.path}: {shapes} shapes; at most {MOST_GEOMS} are read")
    total = 0
    for element in file.root.iter():
        if element.tag in _NOT_READ:
            raise ModelFileError(f"{file.path}: <{element.tag}> is not read; a model is one file with its meshes")
        if element.tag == "mesh" and "builtin" in element.attrib:
            raise ModelFileError(f"{file.path}: <mesh builtin> is not read; use a shape, or a mesh in a file")
        if element.tag in _MEASURED:
            _check_numbers(file.path, element)
        for name, reference in element.items():
            if name.startswith("file"):
                found = beside(file.path, _in_asset_folder(file.root, element, reference), file.path.parent)
                size = found.stat().st_size
                total += size
                if size > MAX_ASSET_BYTES:
                    raise ModelFileError(f"{found}: larger than {MAX_ASSET_BYTES >> 20} MiB")
                if total > MAX_TOTAL_BYTES:
                    raise ModelFileError(f"{file.path}: refers to more than {MAX_TOTAL_BYTES >> 20} MiB of files")
                _check_picture(found)


def _in_asset_folder(root: ET.Element, element: ET.Element, reference: str) -> str:
    """A reference with the folder before it that the compiler's settings give for its kind."""
    for compiler in root.iter("compiler"):
        kind = "texturedir" if element.tag == "texture" else "meshdir"
        if folder := compiler.get(kind) or compiler.get("assetdir"):
            return f"{folder}/{reference}"
    return reference


def _check_picture(path: Path) -> None:
    """Refuse a PNG file that would be unpacked to a picture without measure."""
    with path.open("rb") as stream:
        head = stream.read(24)
    if head.startswith(b"\x89PNG"):
        width, height = int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")
        if max(width, height) > LARGEST_NUMBER:
            raise ModelFileError(f"{path}: a picture of {width} x {height}; at most {LARGEST_NUMBER} each are read")


def _check_numbers(path: Path, element: ET.Element) -> None:
    """Refuse room for more than anybody needs."""
    for name, text in element.items():
        if name in ("name", "class"):
            continue
        if name == "memory":
            raise ModelFileError(f"{path}: <size memory> is not read; the engine takes what it needs")
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            continue  # a name
        if any(not abs(number) <= LARGEST_NUMBER for number in numbers):
            raise ModelFileError(f"{path}: <{element.tag} {name}={text!r:.40}>: at most {LARGEST_NUMBER}")
