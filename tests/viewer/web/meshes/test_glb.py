"""glTF files: whole, aligned, and with the given content."""

import json
import struct
from typing import Any

import numpy as np
import pytest

from cellwright.rendering.scene import Scene, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.scene.triangles import Triangles
from cellwright.util.pose import Pose
from cellwright.viewer.web.meshes import Material, glb, surface


def box(at: float) -> Triangles:
    shape = SceneShape(0, ShapeType.BOX, (0.1, 0.2, 0.3), Pose((at, 0.0, 0.0)), (1.0, 1.0, 1.0, 1.0), ShapeLayer.BOTH)
    return surface(shape, Scene("one", ("world",), (shape,), ()))


def opened(data: bytes) -> tuple[dict[str, Any], bytes]:
    magic, version, length, size, kind = struct.unpack_from("<IIIII", data)
    assert (magic, version, length, kind) == (0x46546C67, 2, len(data), 0x4E4F534A)
    document = json.loads(data[20 : 20 + size])
    rest, kind = struct.unpack_from("<II", data, 20 + size)
    assert (kind, 28 + size + rest) == (0x004E4942, len(data))
    assert size % 4 == rest % 4 == 0
    return document, data[28 + size :]


def values(document: dict[str, Any], data: bytes, number: int) -> Any:
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
    found = np.frombuffer(data, kind, view["byteLength"] // 4, view["byteOffset"])
    return found.reshape(-1, 3) if accessor["type"] == "VEC3" else found


def test_glb_has_one_primitive_per_material() -> None:
    white, glass = Material(), Material(opacity=0.4)
    red, half = (1.0, 0.0, 0.0, 1.0), (0.5, 0.5, 0.5, 0.4)
    document, data = opened(glb([(box(0), red, white), (box(1), half, glass), (box(2), (0, 0, 1, 1), white)]))
    primitives = document["meshes"][0]["primitives"]
    assert [each["material"] for each in primitives] == [0, 1]
    assert [each["alphaMode"] for each in document["materials"]] == ["OPAQUE", "BLEND"]
    points = values(document, data, primitives[0]["attributes"]["POSITION"])
    assert points[:, 0].min() == pytest.approx(-0.1)
    assert points[:, 0].max() == pytest.approx(2.1)
    accessor = document["accessors"][primitives[0]["attributes"]["POSITION"]]
    assert (accessor["min"], accessor["max"]) == (points.min(axis=0).tolist(), points.max(axis=0).tolist())
    indices = values(document, data, primitives[0]["indices"])
    assert indices.max() == len(points) - 1
    colours = values(document, data, primitives[0]["attributes"]["COLOR_0"])
    assert {tuple(each) for each in colours.tolist()} == {(1, 0, 0), (0, 0, 1)}
    grey = values(document, data, primitives[1]["attributes"]["COLOR_0"])
    np.testing.assert_allclose(grey, 0.2140, atol=1e-4)  # half as bright to the eye is a fifth of the light


def test_glb_of_shadow_caster_is_masked_out() -> None:
    document, _ = opened(glb([(box(0), (0, 0, 0, 1), Material(opacity=0.0))]))
    material = document["materials"][0]
    assert material["alphaMode"] == "MASK"
    assert material["pbrMetallicRoughness"]["baseColorFactor"][3] < material["alphaCutoff"]
