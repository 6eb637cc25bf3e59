"""Meshes for browsers: surfaces of a scene's shapes, written as binary glTF."""

import json
import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene import Scene, SceneShape
from cellwright.rendering.scene.scene import linear
from cellwright.rendering.scene.triangles import Triangles, join_triangles, shape_triangles

_MAX_CORNERS, _MIN_CORNERS = 48, 12  # corners of a circle
_MAGIC, _VERSION = 0x46546C67, 2
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_FLOAT, _UINT = 5126, 5125


def surface(shape: SceneShape, scene: Scene) -> Triangles:
    """Surface of a shape, in the frame of its body."""
    return shape_triangles(shape, scene, _corners)


def _corners(radius: float) -> int:
    return int(min(max(round(220 * math.sqrt(max(radius, 0.0))), _MIN_CORNERS), _MAX_CORNERS) // 4 * 4)


def node_name(name: str) -> str:
    """Name as one step of a node's path."""
    return name.replace("/", ".") or "unnamed"


Colour = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Material:
    """Material of a surface: roughness, metal and opacity, all 0..1.

    A surface without opacity is not drawn, and casts a shadow.
    """

    roughness: float = 0.55
    metal: float = 0.0
    opacity: float = 1.0


def glb(pieces: Iterable[tuple[Triangles, Colour, Material]]) -> bytes:
    """Return a glTF file of surfaces with their colours (sRGB 0..1) and materials; one draw call per material."""
    by_material: dict[Material, list[tuple[Triangles, Colour]]] = {}
    for surface, colour, material in pieces:
        by_material.setdefault(material, []).append((surface, colour))
    file = _File()
    primitives = []
    for number, coloured in enumerate(by_material.values()):
        whole = join_triangles([surface for surface, _ in coloured])
        lights = [(linear(np.clip(colour[:3], 0, 1)), len(surface.points)) for surface, colour in coloured]
        colours = np.concatenate([np.tile(light, (count, 1)) for light, count in lights])
        primitives.append(
            {
                "attributes": {
                    "POSITION": file.vectors(whole.points, bounds=True),
                    "NORMAL": file.vectors(whole.normals),
                    "COLOR_0": file.vectors(colours),
                },
                "indices": file.indices(whole.faces),
                "material": number,
            }
        )
    document = {
        "asset": {"version": "2.0", "generator": "Cellwright"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [_described(material) for material in by_material],
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{"byteLength": len(file.data)}],
    }
    return _packed(document, bytes(file.data))


def _described(material: Material) -> dict[str, Any]:
    factors = {
        "baseColorFactor": [1.0, 1.0, 1.0, material.opacity],
        "metallicFactor": material.metal,
        "roughnessFactor": material.roughness,
    }
    if material.opacity <= 0:
        return {"pbrMetallicRoughness": factors, "alphaMode": "MASK", "alphaCutoff": 0.5}
    mode = "OPAQUE" if material.opacity >= 1 else "BLEND"
    return {"pbrMetallicRoughness": factors, "alphaMode": mode, "doubleSided": material.opacity < 1}


class _File:
    """Binary part of a file, as it grows."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def vectors(self, values: NDArray[Any], *, bounds: bool = False) -> int:
        """Add vectors (n, 3); return their index."""
        found = self._add(values.astype("<f4"), _FLOAT, "VEC3", len(values))
        if bounds:
            kept = values.astype(np.float32)
            self.accessors[found] |= {"min": kept.min(axis=0).tolist(), "max": kept.max(axis=0).tolist()}
        return found

    def indices(self, faces: NDArray[Any]) -> int:
        """Add faces; return their index."""
        return self._add(faces.astype("<u4"), _UINT, "SCALAR", faces.size)

    def _add(self, values: NDArray[Any], kind: int, form: str, count: int) -> int:
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes})
        self.data += values.tobytes()
        self.accessors.append({"bufferView": len(self.views) - 1, "componentType": kind, "type": form, "count": count})
        return len(self.accessors) - 1


def _packed(document: dict[str, Any], data: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", len(data), _BIN) + data
    return struct.pack("<III", _MAGIC, _VERSION, 12 + len(chunks)) + chunks
