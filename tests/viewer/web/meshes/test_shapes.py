"""Resolution of shapes on the page."""

import numpy as np

from cellwright.rendering.scene import Scene, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.scene.triangles import Triangles
from cellwright.util.pose import Pose
from cellwright.viewer.web.meshes import surface


def cylinder(radius: float) -> Triangles:
    shape = SceneShape(0, ShapeType.CYLINDER, (radius, 0.1, 0.0), Pose(), (1.0, 1.0, 1.0, 1.0), ShapeLayer.BOTH)
    return surface(shape, Scene("one", ("world",), (shape,), ()))


def corners(found: Triangles) -> int:
    radius = np.hypot(found.points[:, 0], found.points[:, 1])
    rim = found.points[radius > radius.max() / 2]
    return len(np.unique(np.round(rim[:, :2], 9), axis=0))


def test_larger_cylinder_has_more_corners_within_bounds() -> None:
    counts = [corners(cylinder(radius)) for radius in (1e-4, 0.005, 0.01, 0.05, 10.0)]
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (12, 48)
    assert all(count % 4 == 0 for count in counts)
