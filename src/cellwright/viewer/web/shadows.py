"""Shadows: thrown by copies of the bodies that are not drawn themselves.

A shadow map is coarse, some centimetres here, and a surface that is compared with itself in it shows stripes. viser
offers no margin for that comparison. So what throws the shadows stands a margin further from the lamp than what is
drawn, and what is drawn throws none.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from cellwright.rendering.scene import SEEN, Form, Frame, Scene, Shape
from cellwright.rendering.scene.triangles import Triangles
from cellwright.util.pose import Vector3
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.glb import Colour, Material, glb
from cellwright.viewer.web.moment import Moment
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.shapes import surface

_LAMPS = {"robot": (3.2, -4.6, 6.0)}  # a robot looks along x, and is looked at from there
_LAMP = (-3.0, -4.5, 7.0)

_MARGIN = 0.03  # [m]
_LEAST = 0.07  # [m]: smaller bodies throw a shadow that nobody would miss
_LOWEST = 0.02  # [m]: what lies on the floor throws none
_UNSEEN = Material(opacity=0.0)
_BLACK: Colour = (0.0, 0.0, 0.0, 1.0)


class Shadows(Feature):
    """Throws the shadows of the bodies."""

    def __init__(self) -> None:
        self._handles: dict[int, Any] = {}
        self._before: Frame | None = None

    def begin(self, page: Page, scene: Scene) -> None:
        """Put up what throws them."""
        self._handles, self._before = {}, None
        lamp = np.array(lamp_of(page.about))
        root = f"{page.root}/shadows"
        nodes = page.server.scene
        nodes.add_frame(root, show_axes=False, position=-_MARGIN / np.linalg.norm(lamp) * lamp)
        shapes: dict[int, list[Shape]] = defaultdict(list)
        for shape in scene.shapes:
            if shape.layer in SEEN and shape.form is not Form.PLANE and shape.colour[3] >= 1:
                shapes[shape.body].append(shape)
        for body, its in shapes.items():
            surfaces = [
                found for found in (surface(shape, scene) for shape in its) if _matters(found, is_still=body == 0)
            ]
            if surfaces and (body == 0 or _extent(surfaces) >= _LEAST):
                data = glb((found, _BLACK, _UNSEEN) for found in surfaces)
                self._handles[body] = nodes.add_glb(f"{root}/{body}", data, cast_shadow=True, receive_shadow=False)

    def show(self, moment: Moment) -> None:
        """Move them with the bodies."""
        frame, before = moment.frame, self._before
        self._before = frame
        for body, handle in self._handles.items():
            if before is None or (frame.poses[body] != before.poses[body]).any():
                handle.position, handle.wxyz = frame.poses[body, :3], frame.poses[body, 3:]
            if before is None or frame.shown[body] != before.shown[body]:
                handle.visible = bool(frame.shown[body])


def lamp_of(about: Mapping[str, Any]) -> Vector3:
    """From where the light comes: a direction in the world."""
    return _LAMPS.get(str(about.get("kind")), _LAMP)


def _matters(found: Triangles, *, is_still: bool) -> bool:
    return len(found.points) > 0 and not (is_still and float(found.points[:, 2].max()) < _LOWEST)


def _extent(surfaces: list[Triangles]) -> float:
    points = np.concatenate([each.points for each in surfaces])
    return float((points.max(axis=0) - points.min(axis=0)).max())
