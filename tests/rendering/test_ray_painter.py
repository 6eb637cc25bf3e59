"""A painter that casts rays: pictures of the frame that was asked for, however late they are fetched."""

from __future__ import annotations

import numpy as np

from cellwright.pose import Pose
from cellwright.rendering.pinhole import Pinhole
from cellwright.rendering.ray_painter import RayPainter
from cellwright.scene.frame import Frame
from cellwright.scene.scene import Form, Layer, Scene, Shape

BOX = Shape(1, Form.BOX, (0.5, 0.5, 0.5), Pose(), (1.0, 0.0, 0.0, 1.0), Layer.BOTH)
SCENE = Scene("box", ("world", "box"), (BOX,), ())
PINHOLE = Pinhole(17, 9, 1.0)


def box_at(x: float, *, shown: bool = True) -> Frame:
    poses = np.array([[0, 0, 0, 1, 0, 0, 0], [x, 0, 0, 1, 0, 0, 0]], np.float32)
    return Frame(0, poses, np.array([True, shown]))


def test_each_picture_shows_its_own_frame() -> None:
    painter = RayPainter(SCENE)
    numbers = [painter.submit(box_at(x), PINHOLE, Pose(), colour=False, depth=True) for x in (2.0, 3.0, 4.0)]
    painter.forget(numbers[1])
    for number, expected in ((numbers[2], 3.5), (numbers[0], 1.5)):
        drawn = painter.fetch(number)
        assert drawn.colour is None
        assert drawn.depth is not None
        np.testing.assert_allclose(drawn.depth[4, 8], expected, atol=1e-6)
        np.testing.assert_allclose(drawn.depth[np.isfinite(drawn.depth)], expected, atol=1e-5)  # along, not slant
    painter.close()


def test_colour_and_nothing() -> None:
    painter = RayPainter(SCENE)
    seen = painter.fetch(painter.submit(box_at(2.0), PINHOLE, Pose(), colour=True, depth=True))
    assert seen.colour is not None
    red, green, blue = seen.colour[4, 8].astype(int)
    assert red > 2 * max(green, blue)
    hidden = painter.fetch(painter.submit(box_at(2.0, shown=False), PINHOLE, Pose(), colour=False, depth=True))
    assert hidden.depth is not None
    assert np.isinf(hidden.depth).all()
    painter.close()
