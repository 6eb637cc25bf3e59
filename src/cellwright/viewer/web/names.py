"""Names of the bodies, and the directions of their axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from cellwright.rendering.scene import Frame, Scene
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.moment import Moment
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.views import TAB

_ABOVE = 0.04  # [m]: a name stands above its body
_AXES, _RADIUS = 0.12, 0.003  # [m]
_LOOKS = " looks"  # a body that only dresses another has its name and this


class Names(Feature):
    """A label and three axes for each body that is there, when they are wished for."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._names: Any = None
        self._axes: Any = None
        self._bodies: list[int] = []
        self._labels: dict[int, Any] = {}
        self._drawn: Any = None
        self._before: Frame | None = None

    def begin(self, page: Page, scene: Scene) -> None:
        """Offer them."""
        self._page, self._labels, self._drawn, self._before = page, {}, None, None
        self._bodies = [index for index, name in enumerate(scene.bodies) if index and not name.endswith(_LOOKS)]
        if self._names is None:
            with page.tab(TAB):
                self._names = page.server.gui.add_checkbox("Names", initial_value=False)
                self._axes = page.server.gui.add_checkbox(
                    "Frames", initial_value=False, hint="x red, y green, z blue, 12 cm long"
                )

    def show(self, moment: Moment) -> None:
        """Move them with the bodies."""
        page, frame, before = self._page, moment.frame, self._before
        if page is None or page.scene is None or self._names is None:
            return
        self._before = frame
        shown = [body for body in self._bodies if frame.shown[body]]
        wanted = set(shown) if self._names.value else set()
        for body in self._labels.keys() - wanted:
            self._labels.pop(body).remove()
        for body in wanted:
            place = frame.poses[body, :3] + np.array((0.0, 0.0, _ABOVE), np.float32)
            if body not in self._labels:
                self._labels[body] = page.server.scene.add_label(
                    f"{page.root}/names/{body}", _short(page.scene.bodies[body]), position=place
                )
            elif before is None or (frame.poses[body] != before.poses[body]).any():
                self._labels[body].position = place
        if self._axes.value:
            self._draw_axes(page, frame, shown)
        elif self._drawn is not None:
            self._drawn.remove()
            self._drawn = None

    def _draw_axes(self, page: Page, frame: Frame, shown: list[int]) -> None:
        poses = frame.poses[shown]
        if self._drawn is not None and len(self._drawn.batched_positions) == len(poses):
            self._drawn.batched_positions, self._drawn.batched_wxyzs = poses[:, :3], poses[:, 3:]
            return
        if self._drawn is not None:
            self._drawn.remove()
        self._drawn = page.server.scene.add_batched_axes(
            f"{page.root}/frames", poses[:, 3:], poses[:, :3], axes_length=_AXES, axes_radius=_RADIUS
        )


def _short(name: str) -> str:
    """The last part of a full name, which is what people call it."""
    return name.replace("|", "::").rsplit("::", 1)[-1]
