"""Fake page: it keeps the handles that features create."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from cellwright.rendering.scene import Scene, SceneFrame, SceneShape, ShapeLayer, ShapeType
from cellwright.util.pose import Pose
from cellwright.viewer.web.page import Feature


class Handle:
    """Handle of viser's, as far as features use it: it keeps each value."""

    def __init__(self, nodes: dict[str, Handle], name: str, **properties: Any) -> None:
        self.__dict__.update(properties)
        self._nodes, self.name = nodes, name
        self.clicked: Any = None

    def remove(self) -> None:
        """Remove the handle."""
        del self._nodes[self.name]

    def on_update(self, callback: Any) -> Any:
        """Keep the callback."""
        self.clicked = callback
        return callback

    on_click = on_update


class FakePage:
    """Page with nodes by name, and boxes by label."""

    root = "/scene"

    def __init__(self, scene: Scene | None = None, **about: Any) -> None:
        self.scene, self.about = scene, about
        self.nodes: dict[str, Any] = {}
        self.boxes: dict[str, Any] = {}
        self.server: Any = SimpleNamespace(scene=self, gui=self, initial_camera=SimpleNamespace(), atomic=lambda: None)

    def __enter__(self) -> FakePage:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def tab(self, _name: str) -> FakePage:
        return self

    def add_checkbox(self, label: str, initial_value: bool, hint: str = "") -> Any:
        self.boxes[label] = Handle(self.boxes, label, value=initial_value)
        return self.boxes[label]

    def add_button_group(self, label: str, options: tuple[str, ...], order: float = 0.0) -> Any:
        self.boxes[label] = Handle(self.boxes, label, options=options, value=options[0])
        return self.boxes[label]

    def add_frame(self, name: str, **more: Any) -> Any:
        return self._add(name, **more)

    def add_glb(self, name: str, data: bytes, **more: Any) -> Any:
        return self._add(name, data=data, **more)

    def add_batched_glb(self, name: str, data: bytes, **more: Any) -> Any:
        return self._add(name, data=data, **more)

    def add_label(self, name: str, text: str, **more: Any) -> Any:
        return self._add(name, text=text, **more)

    def add_line_segments(self, name: str, points: Any, colors: Any, **more: Any) -> Any:
        return self._add(name, points=points, colors=colors, **more)

    def add_arrows(self, name: str, points: Any, colors: Any, **more: Any) -> Any:
        return self._add(name, points=points, colors=colors, **more)

    def add_batched_axes(self, name: str, wxyzs: Any, positions: Any, **more: Any) -> Any:
        return self._add(name, batched_wxyzs=wxyzs, batched_positions=positions, **more)

    def _add(self, name: str, **properties: Any) -> Any:
        self.nodes[name] = Handle(self.nodes, name, **properties)
        return self.nodes[name]


RED = (1.0, 0.0, 0.0, 1.0)


IDENTITY = (1.0, 0.0, 0.0, 0.0)


def box(body: int, layer: ShapeLayer = ShapeLayer.BOTH, half: float = 0.1) -> SceneShape:
    return SceneShape(body, ShapeType.BOX, (half, half, half), Pose(), RED, layer)


ALIKE = Scene(
    "alike",
    ("world", "arm/hand", "bin1|gear_1", "bin1|gear_2", "bin1|gear_3", "bin1|gear_4", "touched looks"),
    (
        SceneShape(0, ShapeType.PLANE, (5.0, 5.0, 0.1), Pose(), RED, ShapeLayer.LOOKS),
        box(0),
        box(1, ShapeLayer.LOOKS, 0.2),
        box(1, ShapeLayer.TOUCH, 0.3),
        *(box(body, ShapeLayer.BOTH, 0.02) for body in (2, 3, 4, 5)),
        box(6, ShapeLayer.LOOKS, 0.4),
    ),
    (),
)


def frame(time: int = 0, hidden: tuple[int, ...] = (), **places: float) -> SceneFrame:
    """Frame with bodies by number (`b2=0.5`) at a distance along x; all others at the origin."""
    poses = np.tile(np.array([0, 0, 0, 1, 0, 0, 0], np.float32), (len(ALIKE.bodies), 1))
    for name, x in places.items():
        poses[int(name[1:]), 0] = x
    shown = np.ones(len(poses), np.bool_)
    shown[list(hidden)] = False
    return SceneFrame(time, poses, shown)


def page_with(feature: Feature, **about: Any) -> FakePage:
    page = FakePage(ALIKE, **about)
    feature.page = page  # type: ignore[assignment]
    feature.on_scene(ALIKE)
    return page
