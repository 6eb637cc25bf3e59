"""Scene as a model of its own: it shows the same as the first model, and nothing in it collides."""

from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.rendering.scene.engine import EngineScene
from cellwright.rendering.scene.scene import SEEN, ShapeLayer, decode_scene, encode_scene
from tests.rendering.scene.scenes import small


def points(model: Any, data: Any, geom: int) -> Any:
    """Corners of meshes, and centres of other geoms; in the world, in a fixed order."""
    number = int(model.geom_dataid[geom])
    if number < 0:
        return data.geom_xpos[geom][None]
    first, count = model.mesh_vertadr[number], model.mesh_vertnum[number]
    corners = data.geom_xpos[geom] + model.mesh_vert[first : first + count] @ data.geom_xmat[geom].reshape(3, 3).T
    return corners[np.lexsort(np.round(corners, 4).T)]


def test_engine_scene_geoms_have_original_poses() -> None:
    model, data, capture = small()
    shown = EngineScene(decode_scene(encode_scene(capture.scene)), layers=tuple(ShapeLayer))
    data.joint("swing").qpos[0] = 1.0
    data.qpos[1:4] = (1.0, 2.0, 3.0)
    mujoco.mj_kinematics(model, data)
    shown.show(capture.frame(data, 0))
    seen = [geom for geom in range(model.ngeom) if model.geom_rgba[geom, 3] > 0]
    assert len(seen) == shown.model.ngeom
    for kind in set(model.geom_type[seen]):  # there is one of each
        (before,) = (geom for geom in seen if model.geom_type[geom] == kind)
        (after,) = np.flatnonzero(shown.model.geom_type == kind)
        assert points(shown.model, shown.data, int(after)) == pytest.approx(points(model, data, before), abs=1e-5)


def test_engine_scene_has_seen_layers_only() -> None:
    shown = EngineScene(small()[2].scene)
    assert set(shown.model.geom_group) == {int(layer) for layer in SEEN}
    assert not shown.model.geom_contype.any()


def test_hidden_body_is_out_of_sight() -> None:
    model, data, _ = small()
    capture = type(small()[2])(model, parts=lambda: (("part", model.body("ghost").id, False),))
    shown = EngineScene(capture.scene)
    shown.show(capture.frame(data, 0))
    part = capture.scene.bodies.index("part")
    assert shown.data.xpos[part, 2] == -1000.0
