"""Scene as bytes: round trip, and refusal of nonsense."""

import json
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering.camera import Camera
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.scene.scene import decode_scene, encode_scene
from cellwright.rendering.views import gear2017_views
from cellwright.util.errors import MessageError
from tests.rendering.scene.scenes import small


def test_scene_survives_encoding() -> None:
    scene = small()[2].scene
    found = decode_scene(encode_scene(scene))
    assert (found.name, found.bodies, found.shapes) == (scene.name, scene.bodies, scene.shapes)
    assert np.array_equal(found.meshes[0].vertices, scene.meshes[0].vertices)
    assert np.array_equal(found.meshes[0].faces, scene.meshes[0].faces)


def test_views_survive_encoding_and_those_of_2017_need_no_bytes() -> None:
    views = {
        "overview": gear2017_views()["belt"],
        "door": Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.2),
    }
    scene = replace(small()[2].scene, views=views)
    assert decode_scene(encode_scene(scene)).views == views
    model, _, capture = small()
    assert "views" not in json.loads(zlib.decompress(encode_scene(capture.scene)))
    assert SceneCapture(model, views=gear2017_views()).scene.views == {}
    assert SceneCapture(model, views=views).scene.views == views


def test_scene_without_names_of_static_bodies_is_read() -> None:
    scene = small()[2].scene
    document = json.loads(zlib.decompress(encode_scene(scene)))
    del document["static_bodies"]
    found = decode_scene(zlib.compress(json.dumps(document).encode()))
    assert found.shapes == tuple(replace(shape, static_body="") for shape in scene.shapes)


@given(st.binary(max_size=100))
def test_scene_of_random_bytes_is_refused(data: bytes) -> None:
    for text in (data, zlib.compress(data)):
        with pytest.raises(MessageError, match="invalid scene"):
            decode_scene(text)


@given(st.data())
def test_scene_document_with_mistake_is_refused(data: st.DataObject) -> None:
    document = json.loads(zlib.decompress(encode_scene(small()[2].scene)))
    slips = {
        "format": st.just(99),
        "bodies": st.sampled_from([[], [1, 2], 5]),
        "meshes": st.sampled_from([[["AAAA", "AAAA"]], [["", "AAAAAAEAAAACAAAA"]], [1]]),
        "shapes": st.sampled_from(
            [
                [[99, "box", [1, 1, 1], [0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 1], 1, None]],
                [[0, "box", [1, 1], [0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 1], 1, None]],
                [[0, "box", [1, 1, -1], [0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 1], 1, None]],
                [[0, "cone", [1, 1, 1], [0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 1], 1, None]],
                [[0, "mesh", [1, 1, 1], [0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 1], 1, 7]],
                [[0, "box", [1, 1, 1], [0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 1], 9, None]],
                [[0, "box"]],
            ]
        ),
        "static_bodies": st.sampled_from([5, ["bin1"]]),
        "views": st.sampled_from(
            [
                5,
                {"door": [[0, 0, 1], [1, 0, 0], [0, 0, 1], 0.8]},
                {"overview": [[0, 0, 1], [0, 0, 1], [0, 0, 1], 0.8]},
                {"overview": [[0, 0, 1], [1, 0], [0, 0, 1], 0.8]},
                {"overview": [[0, 0, "x"], [1, 0, 0], [0, 0, 1], 0.8]},
                {"overview": 1},
            ]
        ),
    }
    key = data.draw(st.sampled_from(sorted(slips)))
    document[key] = data.draw(slips[key])
    if key == "shapes":
        del document["static_bodies"]  # of another number of shapes, which is a mistake too
    with pytest.raises(MessageError, match="invalid scene"):
        decode_scene(zlib.compress(json.dumps(document).encode()))


def test_truncated_scene_is_refused() -> None:
    text = encode_scene(small()[2].scene)
    with pytest.raises(MessageError, match="truncated"):
        decode_scene(text[:-5])
