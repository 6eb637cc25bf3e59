"""A scene as bytes, for a wire and for a recording: JSON, compressed."""

from __future__ import annotations

import base64
import json
import zlib
from typing import Any

import numpy as np

from cellwright.rendering.scene.frame import MOST_BODIES
from cellwright.rendering.scene.scene import Form, Layer, Mesh, Scene, Shape
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose

_FORMAT = 1
LARGEST = 256 << 20
"""Bytes of the largest scene that is taken, uncompressed."""


def encode_scene(scene: Scene) -> bytes:
    """The scene as bytes."""
    document = {
        "format": _FORMAT,
        "name": scene.name,
        "bodies": scene.bodies,
        "shapes": [
            [
                shape.body,
                shape.form.value,
                shape.size,
                shape.pose.position,
                shape.pose.quaternion,
                shape.colour,
                int(shape.layer),
                shape.mesh,
            ]
            for shape in scene.shapes
        ],
        "meshes": [[_text(mesh.vertices, "<f4"), _text(mesh.faces, "<i4")] for mesh in scene.meshes],
    }
    return zlib.compress(json.dumps(document).encode(), 6)


def decode_scene(data: bytes) -> Scene:
    """The scene in these bytes, which may come from anywhere.

    Raises:
        MessageError: the bytes are no scene.
    """
    try:
        unpacker = zlib.decompressobj()
        text = unpacker.decompress(data, LARGEST)
        if not unpacker.eof:
            raise ValueError("it is cut short, or too large")
        return _scene(json.loads(text))
    except (zlib.error, ValueError, TypeError, KeyError, IndexError, RecursionError) as fault:
        raise MessageError(f"these {len(data)} bytes are no scene: {fault}") from None


def _scene(document: dict[str, Any]) -> Scene:
    if document["format"] != _FORMAT:
        raise ValueError(f"its format is {document['format']!r:.20}, and {_FORMAT} is known")
    meshes = tuple(_mesh(*each) for each in document["meshes"])
    bodies = tuple(document["bodies"])
    if not 1 <= len(bodies) <= MOST_BODIES or not all(isinstance(name, str) for name in bodies):
        raise ValueError("its bodies have no names")
    shapes = tuple(_shape(each, len(bodies), len(meshes)) for each in document["shapes"])
    return Scene(str(document["name"]), bodies, shapes, meshes)


def _shape(entry: Any, bodies: int, meshes: int) -> Shape:
    body, form, size, position, quaternion, colour, layer, mesh = entry
    numbers = np.array([*size, *position, *quaternion, *colour], np.float64)
    if numbers.shape != (14,) or not np.isfinite(numbers).all() or (numbers[:3] < 0).any():
        raise ValueError("a shape's numbers make no sense")
    known = Form(form)
    if not 0 <= body < bodies or (known is Form.MESH and not 0 <= mesh < meshes):
        raise ValueError("a shape belongs to nothing")
    (sx, sy, sz, x, y, z, qw, qx, qy, qz, red, green, blue, opacity) = numbers.tolist()
    return Shape(
        body=int(body),
        form=known,
        size=(sx, sy, sz),
        pose=Pose((x, y, z), (qw, qx, qy, qz)),
        colour=(red, green, blue, opacity),
        layer=Layer(layer),
        mesh=int(mesh) if known is Form.MESH else None,
    )


def _text(array: np.typing.NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, kind).tobytes()).decode()


def _mesh(vertices: str, faces: str) -> Mesh:
    points = np.frombuffer(base64.b64decode(vertices), "<f4").reshape(-1, 3)
    triangles = np.frombuffer(base64.b64decode(faces), "<i4").reshape(-1, 3)
    if not np.isfinite(points).all() or (triangles < 0).any() or (triangles >= len(points)).any():
        raise ValueError("a mesh makes no sense")
    return Mesh(points.astype(np.float32), triangles.astype(np.int32))
