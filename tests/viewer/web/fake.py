"""Fake page: it keeps the handles that features create."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from cellwright.rendering.scene import Scene


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
