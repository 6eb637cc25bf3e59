"""Scene overlays: body names and frames, contact forces, sensor rays, tool paths."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene import Frame, Scene
from cellwright.viewer.web.page import Feature, Moment, Page
from cellwright.viewer.web.views import TAB, tool_point

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


_ARROW_COLOUR = (0.86, 0.15, 0.2)
_PER_NEWTON = 0.01  # [m]
_MIN_ARROW, _MAX_ARROW = 0.015, 0.4  # [m]
_SHAFT, _HEAD, _HEAD_LENGTH = 0.003, 0.007, 0.015  # [m]


class Contacts(Feature):
    """An arrow for each contact, as long as its force is strong."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._box: Any = None
        self._handle: Any = None

    def begin(self, page: Page, scene: Scene) -> None:  # noqa: ARG002
        """Offer it."""
        self._page, self._handle = page, None
        if self._box is None:
            with page.tab(TAB):
                self._box = page.server.gui.add_checkbox(
                    "Contacts and forces",
                    initial_value=False,
                    hint="A centimetre is a newton; what is at rest sleeps, and is not told of",
                )

    def wants(self) -> dict[str, Any]:
        """Contacts, while they are shown."""
        return {"contacts": True} if self._box is not None and self._box.value else {}

    def told(self, answer: dict[str, Any]) -> None:
        """Draw them."""
        rows = answer.get("contacts")
        if self._page is None or self._box is None:
            return
        if not rows or not self._box.value:
            if self._handle is not None:
                self._handle.remove()
                self._handle = None
            return
        arrows = _arrows(np.array(rows, np.float32))
        if self._handle is None:
            self._handle = self._page.server.scene.add_arrows(
                f"{self._page.root}/contacts",
                arrows,
                _ARROW_COLOUR,
                shaft_radius=_SHAFT,
                head_radius=_HEAD,
                head_length=_HEAD_LENGTH,
            )
        else:
            self._handle.points = arrows


def _arrows(rows: np.typing.NDArray[np.float32]) -> np.typing.NDArray[np.float32]:
    """Where the arrows begin and end (n, 2, 3) [m], of contacts (n, 6): they point up, away from what is below."""
    places, forces = rows[:, :3], rows[:, 3:]
    forces = np.where(forces[:, 2:] < 0, -forces, forces)
    strength = np.linalg.norm(forces, axis=1, keepdims=True)
    length = np.clip(_PER_NEWTON * strength, _MIN_ARROW, _MAX_ARROW)
    ends = places + forces / np.maximum(strength, 1e-9) * length
    return np.stack([places, ends], axis=1).astype(np.float32)


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


PATH_DURATION = 20.0
"""So long [s] of simulation time the way is shown."""

_PATH_STEP = 0.01  # [m] between two points of it
_MAX_PATH_POINTS = 800
_PATH_COLOURS = ((0.93, 0.35, 0.12), (0.1, 0.45, 0.75))


class ToolPaths(Feature):
    """A line behind each tool."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._box: Any = None
        self._ways: list[deque[tuple[int, Any]]] = []
        self._handles: list[Any] = []

    def begin(self, page: Page, scene: Scene) -> None:
        """Find the tools of a scene."""
        self._page = page
        self._tools = [tool for tool in page.about.get("tools", ()) if _is_tool(tool, scene)]
        self._ways = [deque(maxlen=_MAX_PATH_POINTS) for _ in self._tools]
        self._handles = []
        if self._box is None and self._tools:
            with page.tab(TAB):
                self._box = page.server.gui.add_checkbox("Path of the tool", initial_value=False)
            self._box.on_update(lambda _event: self._clear())

    def show(self, moment: Moment) -> None:
        """Draw where they were."""
        page = self._page
        if page is None or self._box is None or not self._box.value:
            return
        if moment.is_cut:
            self._clear()
        for number, (tool, way) in enumerate(zip(self._tools, self._ways, strict=True)):
            point = tool_point(moment.frame, tool)
            now = moment.frame.time
            is_new = not way or float(np.linalg.norm(point - way[-1][1])) > _PATH_STEP
            if is_new:
                way.append((now, point))
            is_old = False
            while way and way[0][0] < now - PATH_DURATION * 1e9:
                way.popleft()
                is_old = True
            if is_new or is_old:
                self._draw(page, number)

    def _draw(self, page: Page, number: int) -> None:
        points = np.array([point for _, point in self._ways[number]], np.float32)
        segments = np.stack([points[:-1], points[1:]], axis=1) if len(points) > 1 else np.zeros((0, 2, 3), np.float32)
        if number < len(self._handles):
            self._handles[number].points = segments
            return
        self._handles.append(
            page.server.scene.add_line_segments(
                f"{page.root}/path of tool {number + 1}",
                segments,
                _PATH_COLOURS[number % len(_PATH_COLOURS)],
                thickness=3.0,
                thickness_units="screen",
            )
        )

    def _clear(self) -> None:
        for way in self._ways:
            way.clear()
        for handle in self._handles:
            handle.remove()
        self._handles = []


def _is_tool(tool: Any, scene: Scene) -> bool:
    return isinstance(tool, list) and len(tool) == 2 and isinstance(tool[0], int) and 0 <= tool[0] < len(scene.bodies)
