"""Model files (SDF, URDF, MJCF): search, bounded parsing, and refusal of harmful files.

The engine allocates and computes whatever a file requests: one line can request all memory, or an hour.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from cellwright.config.parsing.sources import note_source, read_at_most, reason
from cellwright.util.errors import CellwrightError
from cellwright.util.files import LFS_POINTER, is_lfs_pointer, open_to_read

MAX_MODEL_BYTES = 1 << 20
"""Maximum size of a model file [bytes]."""
MAX_ASSET_BYTES = 32 << 20
"""Maximum size of a mesh or picture that a model refers to [bytes]."""

MAX_ELEMENTS = 20_000
MAX_DEPTH = 50
"""Maximum nesting of elements."""

_CONFIG = "model.config"
_DECLARATION = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_PACKAGE_URI = re.compile(r"(?:package|model)://(.*)", re.IGNORECASE | re.DOTALL)
_FILE_URI = re.compile(r"file:(?://(?:localhost(?=/))?)?", re.IGNORECASE)
_FORMATS = {"sdf": "sdf", "robot": "urdf", "mujoco": "mjcf"}
MAX_GEOMS = 200
"""Maximum number of shapes of one model."""
MAX_TOTAL_BYTES = 50 << 20
"""Maximum total size of the meshes and pictures of one file [bytes]."""
MAX_NUMBER = 4096
"""Maximum of any number that a file allocates memory by: users' values, a picture's width and height in pixels, …."""
UNBOUNDED = (
    *("model", "attach", "plugin", "extension"),
    *("flexcomp", "composite", "flex", "skin", "hfield", "replicate"),
)
"""Elements of MJCF that read other models or programs, or make any number of bodies."""
_UNSUPPORTED = ("include", *UNBOUNDED, "keyframe")
_SIZED_ELEMENTS = ("size", "texture")


class ModelFileError(CellwrightError):
    """Unusable model file."""


@dataclass(frozen=True, slots=True)
class ModelFile:
    """Parsed model file; `format` is sdf, urdf or mjcf, from its root element."""

    path: Path
    format: str
    root: ET.Element


def open_model(path: Path) -> ModelFile:
    """Return the model in a file, or in a folder whose `model.config` names the file.

    Raises:
        ModelFileError: there is no model, or it is refused.
    """
    if path.is_dir():
        path = _in_folder(path)
    root = _parse(path)
    if root.tag not in _FORMATS:
        raise ModelFileError(f"{path}: not an SDF, URDF or MJCF file (root element <{root.tag}>)")
    return ModelFile(path, _FORMATS[root.tag], root)


@dataclass(frozen=True, slots=True)
class FileReference:
    """Reference to a mesh or a picture in a model file, in any form that such files have.

    Attributes:
        package: name of the package; None for a path.
        paths: the path, relative to that package if there is one: as written, and with its escapes (`%20`) decoded.
    """

    package: str | None
    paths: tuple[str, ...]

    @classmethod
    def read(cls, reference: str) -> FileReference:
        """Return a reference: `package://NAME/PATH`, `model://NAME/PATH`, `file:///PATH` or a path.

        URIs without a package's name, `package:///PATH` or `package://FILE`, are paths. A host is ignored.

        Example:
            >>> FileReference.read("package://arm//meshes/link%201.stl")
            FileReference(package='arm', paths=('meshes/link%201.stl', 'meshes/link 1.stl'))
        """
        text = reference.strip().replace("\\", "/")
        package, path = None, _FILE_URI.sub("", text)
        if scheme := _PACKAGE_URI.match(text):
            name, _, rest = scheme[1].partition("/")
            package, path = (name, rest.lstrip("/")) if name and rest.strip("/") else (None, scheme[1].strip("/"))
        return cls(package, tuple(dict.fromkeys((path, unquote(path)))))


def referenced_file(path: Path, reference: str, folder: Path) -> Path:
    """Return the file that `path` refers to, which must lie in `folder`.

    `model://NAME/…` and `package://NAME/…` are relative to the folder of that name.

    Raises:
        ModelFileError: the file is missing or lies elsewhere.
    """
    named = FileReference.read(reference)
    base = path.parent
    if named.package is not None:
        base = next((parent for parent in path.resolve().parents if parent.name == named.package), folder)
    found = next((base / each for each in named.paths if (base / each).is_file()), base / named.paths[0])
    if not found.resolve().is_relative_to(folder.resolve()):
        raise ModelFileError(f"{path}: {reference} is outside the model folder {folder}")
    if not found.is_file():
        raise ModelFileError(f"{path}: there is no file {reference}")
    # the engine reads the file directly
    note_source(found)
    return found


def _in_folder(folder: Path) -> Path:
    """Return the newest SDF file that a folder's `model.config` names."""
    config = folder / _CONFIG
    if not config.is_file():
        raise ModelFileError(f"{folder}: no {_CONFIG} in this folder; name the model file itself")
    named = [(element.get("version", ""), (element.text or "").strip()) for element in _parse(config).iter("sdf")]
    if not named:
        raise ModelFileError(f"{config}: no <sdf> element; add one with the name of the model file")
    return referenced_file(config, max(named)[1], folder)


def _parse(path: Path) -> ET.Element:
    try:
        if path.exists() and not path.is_file():
            raise ModelFileError(f"{path}: not a regular file")
        content = read_at_most(path, MAX_MODEL_BYTES)
        if content is None:
            raise ModelFileError(f"{path}: larger than {MAX_MODEL_BYTES >> 20} MiB")
        if is_lfs_pointer(content):
            raise ModelFileError(f"{path}: {LFS_POINTER}")
        text = content.decode("utf-8")
    except FileNotFoundError:
        raise ModelFileError(f"{path}: there is no such file") from None
    except UnicodeDecodeError:
        raise ModelFileError(f"{path}: not UTF-8 text; save the file as UTF-8") from None
    except (OSError, ValueError) as error:
        raise ModelFileError(f"{path}: cannot be read: {reason(error)}") from None
    if _DECLARATION.search(text):
        raise ModelFileError(f"{path}: document types and entities are not supported; remove them")
    try:
        root = ET.fromstring(text)  # noqa: S314 - without declarations, nothing can expand or reach other files
    except ET.ParseError as error:
        line, column = error.position
        raise ModelFileError(f"{path}:{line}: invalid XML (column {column + 1})") from None
    except (ValueError, RecursionError):
        raise ModelFileError(f"{path}: invalid XML") from None
    _check_extent(path, root)
    return root


def _check_extent(path: Path, root: ET.Element) -> None:
    """Refuse a model that is too large or too deep: the engine, for one, descends without limit."""
    count, level = 0, [root]
    for _ in range(MAX_DEPTH):
        count += len(level)
        if count > MAX_ELEMENTS:
            raise ModelFileError(f"{path}: more than {MAX_ELEMENTS} elements")
        level = [child for element in level for child in element]
        if not level:
            return
    raise ModelFileError(f"{path}: elements nested deeper than {MAX_DEPTH}")


def check_mjcf(file: ModelFile) -> None:
    """Refuse an MJCF file that is no rigid body or that reaches out of its folder.

    Raises:
        ModelFileError: it is refused.
    """
    if (shapes := sum(1 for _ in file.root.iter("geom"))) > MAX_GEOMS:
        raise ModelFileError(f"{file.path}: too many shapes (got {shapes}, at most {MAX_GEOMS})")
    total = 0
    for element in file.root.iter():
        if element.tag in _UNSUPPORTED:
            raise ModelFileError(
                f"{file.path}: <{element.tag}> is not supported; put the model into one file with its meshes"
            )
        if fault := mjcf_fault(element.tag, element.attrib):
            raise ModelFileError(f"{file.path}: {fault}")
        for name, reference in element.items():
            if name.startswith("file"):
                found = referenced_file(file.path, _in_asset_folder(file.root, element, reference), file.path.parent)
                size = found.stat().st_size
                total += size
                if size > MAX_ASSET_BYTES:
                    raise ModelFileError(f"{found}: larger than {MAX_ASSET_BYTES >> 20} MiB")
                if total > MAX_TOTAL_BYTES:
                    raise ModelFileError(f"{file.path}: refers to more than {MAX_TOTAL_BYTES >> 20} MiB of files")
                check_asset(found)


def _in_asset_folder(root: ET.Element, element: ET.Element, reference: str) -> str:
    """Return a reference below the folder that the compiler's settings give for its kind."""
    for compiler in root.iter("compiler"):
        kind = "texturedir" if element.tag == "texture" else "meshdir"
        if folder := compiler.get(kind) or compiler.get("assetdir"):
            return f"{folder}/{reference}"
    return reference


def check_asset(path: Path) -> None:
    """Refuse a pointer in place of a file, and a PNG file that would unpack to an unbounded picture.

    Raises:
        ModelFileError: it is refused.
    """
    with open_to_read(path) as stream:
        head = stream.read(100)
    if is_lfs_pointer(head):
        raise ModelFileError(f"{path}: {LFS_POINTER}")
    if head.startswith(b"\x89PNG"):
        width, height = int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")
        if max(width, height) > MAX_NUMBER:
            raise ModelFileError(
                f"{path}: width and height must be at most {MAX_NUMBER} pixels (got {width} x {height})"
            )


def mjcf_fault(tag: str, attributes: Mapping[str, str]) -> str | None:
    """Return what is wrong with an element of MJCF that makes the engine allocate what no model needs."""
    if tag == "mesh" and "builtin" in attributes:
        return "<mesh builtin> is not supported; use a shape, or a mesh in a file"
    if tag not in _SIZED_ELEMENTS:
        return None
    for name, text in attributes.items():
        if name in ("name", "class"):
            continue
        if name == "memory":
            return "<size memory> is not supported; remove it, the engine sizes its memory itself"
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            continue  # a name
        if any(not abs(number) <= MAX_NUMBER for number in numbers):
            return f"{name} of <{tag}> must be at most {MAX_NUMBER} (got {text!r:.40})"
    return None
