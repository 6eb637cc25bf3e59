"""The bodies of a scene on the page: one node for each, and one for all that look alike."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene import SEEN, TOUCHED, Form, Frame, Layer, Scene, Shape
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.glb import Colour, Material, glb
from cellwright.viewer.web.moment import Moment
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.shapes import surface
from cellwright.viewer.web.views import TAB

_FEW = 4
"""So many bodies that look alike, or more, are drawn as one."""
_FLOOR = Material(1.0)
_TOUCHED_COLOURS: tuple[Colour, ...] = ((0.16, 0.47, 0.71, 0.62), (0.85, 0.45, 0.13, 0.62), (0.35, 0.6, 0.35, 0.62))


class Bodies(Feature):
    """What is seen of the bodies, and what the engine takes for them."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._looks: BodyNodes | None = None
        self._touched: BodyNodes | None = None
        self._newest: Frame | None = None
        self._box: Any = None

    def begin(self, page: Page, scene: Scene) -> None:
        """Put the bodies of a scene on the page."""
        self._page, self._newest = page, None
        self._looks, self._touched = BodyNodes(page, scene, "bodies", SEEN), None
        if self._box is None:
            with page.tab(TAB):
                self._box = page.server.gui.add_checkbox(
                    "Collision shapes", initial_value=False, hint="What the engine takes the bodies for"
                )
            self._box.on_update(lambda _event: self.show_touched(self._box.value))
        if self._box.value:
            self.show_touched(True)

    def show(self, moment: Moment) -> None:
        """Put them where they are."""
        self._newest = moment.frame
        for nodes in (self._looks, self._touched):
            if nodes is not None:
                nodes.show(moment.frame)

    def show_touched(self, is_wanted: bool) -> None:  # noqa: FBT001
        """Show what the engine takes the bodies for, in place of what they look like."""
        page = self._page
        if page is None or page.scene is None:
            return
        if is_wanted and self._touched is None:
            self._touched = BodyNodes(page, page.scene, "touched", TOUCHED)
            if self._newest is not None:
                self._touched.show(self._newest)
        if self._touched is not None:
            self._touched.set_visible(is_wanted)
        if self._looks is not None:
            self._looks.set_visible(not is_wanted)


@dataclass(slots=True)
class _Single:
    body: int
    handle: Any


@dataclass(slots=True)
class _Alike:
    bodies: NDArray[np.intp]
    handle: Any


class BodyNodes:
    """Nodes of the page for the bodies of a scene.

    Args:
        page: where.
        scene: whose.
        name: of the node above them.
        layers: which of their shapes.
    """

    def __init__(self, page: Page, scene: Scene, name: str, layers: Collection[Layer]) -> None:
        self._scene = page.server.scene
        self._root = self._scene.add_frame(f"{page.root}/{name}", show_axes=False)
        self._before: Frame | None = None
        self._singles: list[_Single] = []
        self._alike: list[_Alike] = []
        is_touched = Layer.TOUCH in layers
        shapes: dict[int, list[Shape]] = defaultdict(list)
        for shape in scene.shapes:
            if shape.layer in layers:
                shapes[shape.body].append(shape)
        groups: dict[Any, list[int]] = defaultdict(list)
        for body, its in shapes.items():
            groups[tuple((s.form, s.size, s.pose, s.colour, s.mesh) for s in its)].append(body)
        for bodies in groups.values():
            data = glb(_pieces(shapes[bodies[0]], scene, is_touched=is_touched))
            path = f"{page.root}/{name}/{_node(scene.bodies[bodies[0]])}"
            if len(bodies) < _FEW:
                for body in bodies:
                    path = f"{page.root}/{name}/{_node(scene.bodies[body])}"
                    single = self._scene.add_glb(path, data, cast_shadow=False)
                    self._singles.append(_Single(body, single))
            else:
                handle = self._scene.add_batched_glb(
                    f"{path} and others alike",
                    data,
                    batched_wxyzs=np.tile((1.0, 0.0, 0.0, 0.0), (len(bodies), 1)),
                    batched_positions=np.zeros((len(bodies), 3)),
                    batched_scales=np.zeros((len(bodies), 3)),
                    lod="off",
                    cast_shadow=False,
                )
                self._alike.append(_Alike(np.array(bodies), handle))

    def set_visible(self, is_visible: bool) -> None:  # noqa: FBT001
        """Show them all, or none."""
        self._root.visible = is_visible

    def show(self, frame: Frame) -> None:
        """Put them where a frame says; what has not moved is not told again."""
        before, self._before = self._before, frame
        if before is None:
            moved = np.ones(len(frame.poses), np.bool_)
            switched = moved
        else:
            moved = (frame.poses != before.poses).any(axis=1)
            switched = frame.shown != before.shown
        for single in self._singles:
            body = single.body
            if moved[body]:
                single.handle.position = frame.poses[body, :3]
                single.handle.wxyz = frame.poses[body, 3:]
            if switched[body]:
                single.handle.visible = bool(frame.shown[body])
        for alike in self._alike:
            bodies = alike.bodies
            if switched[bodies].any():
                alike.handle.batched_scales = np.repeat(frame.shown[bodies, None], 3, axis=1).astype(np.float32)
            if moved[bodies].any():
                alike.handle.batched_positions = frame.poses[bodies, :3]
                alike.handle.batched_wxyzs = frame.poses[bodies, 3:]


def _pieces(shapes: Sequence[Shape], scene: Scene, *, is_touched: bool) -> list[tuple[Any, Colour, Material]]:
    if is_touched:
        return [
            (surface(shape, scene), colour, Material(0.9, 0.0, colour[3]))
            for number, shape in enumerate(shapes)
            for colour in [_TOUCHED_COLOURS[number % len(_TOUCHED_COLOURS)]]
        ]
    return [
        (surface(shape, scene), shape.colour, _FLOOR if shape.form is Form.PLANE else material(shape.colour))
        for shape in shapes
    ]


def material(colour: Colour) -> Material:
    """What something of this colour is made of: what is grey and light is metal, the rest is paint or rubber."""
    red, green, blue, opacity = colour
    brightness = max(red, green, blue)
    tint = brightness - min(red, green, blue)
    if opacity < 1:
        return Material(0.15, 0.0, round(opacity, 2))
    if tint < 0.06 and 0.4 < brightness < 0.78:
        return Material(0.45, 0.2)
    return Material(0.85 if brightness < 0.2 else 0.7)


def _node(name: str) -> str:
    """A body's name as one step of a path."""
    return name.replace("/", ".") or "unnamed"
