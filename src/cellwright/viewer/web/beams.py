"""What sensors look at: beams, cones, fans and frustums, and whether they see something."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene import Scene
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.views import TAB

_DARK, _LIT, _OFF = (0.35, 0.55, 0.75), (0.95, 0.2, 0.1), (0.6, 0.6, 0.6)
_PLACE = ("position", "quaternion")  # those that move say where they are
_THICKNESS = 2.0  # pixels
Segments = NDArray[np.float32]


class Beams(Feature):
    """Lines for what each sensor looks at."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._box: Any = None
        self._sensors: list[dict[str, Any]] = []
        self._lines: dict[str, Any] = {}
        self._labels: list[Any] = []
        self._shown: dict[str, Any] = {}

    def begin(self, page: Page, scene: Scene) -> None:  # noqa: ARG002
        """Find the sensors of a scene."""
        self._page = page
        self._lines, self._labels, self._shown = {}, [], {}
        self._sensors = [each for each in page.about.get("sensors", ()) if each.get("form") in _FORMS]
        if self._box is None and self._sensors:
            with page.tab(TAB):
                self._box = page.server.gui.add_checkbox(
                    "Sensors", initial_value=False, hint="What they look at; red where they see something"
                )

    def wants(self) -> dict[str, Any]:
        """What sensors find, while they are shown."""
        return {"sensors": True} if self._sensors and self._box is not None and self._box.value else {}

    def told(self, answer: dict[str, Any]) -> None:
        """Draw them."""
        found = answer.get("sensors")
        if self._page is None or self._box is None:
            return
        if found is None or not self._box.value:
            for handle in (*self._lines.values(), *self._labels):
                handle.remove()
            self._lines, self._labels, self._shown = {}, [], {}
            return
        if not self._labels:
            self._label(self._page)
        for sensor in self._sensors:
            name = str(sensor["name"])
            reading = found.get(name)
            if name in self._lines and self._shown.get(name) == reading:
                continue
            self._shown[name] = reading
            self._draw(self._page, name, sensor, reading)

    def _draw(self, page: Page, name: str, sensor: dict[str, Any], reading: dict[str, Any] | None) -> None:
        place = {**sensor, **{name: reading[name] for name in _PLACE if name in reading}} if reading else sensor
        segments = _world(place, _FORMS[sensor["form"]](sensor, reading or {}))
        colour = _OFF if reading is None else _LIT if reading.get("sees") else _DARK
        if name in self._lines and self._lines[name].points.shape == segments.shape:
            self._lines[name].points = segments
            self._lines[name].colors = np.array(colour)
            return
        self._lines[name] = page.server.scene.add_line_segments(
            f"{page.root}/sensors/{_node(name)}", segments, colour, thickness=_THICKNESS, thickness_units="screen"
        )

    def _label(self, page: Page) -> None:
        for sensor in self._sensors:
            path = f"{page.root}/sensors/{_node(str(sensor['name']))} name"
            handle = page.server.scene.add_label(path, str(sensor["name"]), position=sensor["position"])
            self._labels.append(handle)


def _beam(sensor: dict[str, Any], reading: dict[str, Any]) -> Segments:
    """The ray, as far as it goes."""
    near, far = sensor["near"], sensor["far"]
    ranges = reading.get("ranges") or [None]
    end = near + (far if ranges[0] is None else ranges[0])
    return np.array([[(near, 0, 0), (end, 0, 0)]], np.float32)


def _cone(sensor: dict[str, Any], reading: dict[str, Any]) -> Segments:
    near, angle = sensor["near"], sensor["angle"]
    ranges = reading.get("ranges") or [None]
    far = sensor["far"] if ranges[0] is None else ranges[0]
    around = np.linspace(0, 2 * math.pi, 13)
    width = far * math.tan(angle)
    rim = np.column_stack([np.full(13, near + far), width * np.cos(around), width * np.sin(around)])
    spokes = [[(near, 0, 0), point] for point in rim[:-1:3].tolist()]
    return np.array([*np.stack([rim[:-1], rim[1:]], axis=1).tolist(), *spokes], np.float32)


def _fan(sensor: dict[str, Any], reading: dict[str, Any]) -> Segments:
    """The outline that is seen, and the sides of the fan."""
    ranges = reading.get("ranges") or [None, None]
    angles = np.linspace(-sensor["angle"], sensor["angle"], len(ranges))
    lengths = np.array([sensor["far"] if each is None else each for each in ranges])
    rim = np.column_stack([lengths * np.cos(angles), lengths * np.sin(angles), np.zeros(len(angles))])
    sides = [[(0, 0, 0), rim[index].tolist()] for index in (0, len(rim) // 2, -1)]
    return np.array([*np.stack([rim[:-1], rim[1:]], axis=1).tolist(), *sides], np.float32)


def _frustum(sensor: dict[str, Any], _reading: dict[str, Any]) -> Segments:
    across = math.tan(sensor["angle"])
    up = across / sensor["aspect"]
    near, far = (
        [(depth, depth * across * u, depth * up * v) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        for depth in (sensor["near"], sensor["far"])
    )
    edges = [[each[i], each[(i + 1) % 4]] for each in (near, far) for i in range(4)]
    return np.array([*edges, *([a, b] for a, b in zip(near, far, strict=True))], np.float32)


_FORMS = {"beam": _beam, "cone": _cone, "fan": _fan, "frustum": _frustum}


def _world(sensor: dict[str, Any], segments: Segments) -> Segments:
    """Segments in a sensor's frame, in the world."""
    w, *vector = sensor["quaternion"]
    across = 2 * np.cross(vector, segments)
    placed: NDArray[np.float64] = segments + w * across + np.cross(vector, across) + np.array(sensor["position"])
    found: Segments = placed.astype(np.float32)
    return found


def _node(name: str) -> str:
    return name.replace("/", ".") or "unnamed"
