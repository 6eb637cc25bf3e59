"""Scene overlays: body names and frames, contact forces, sensor rays, tool paths."""

import math
from collections import deque
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.viewer.web.meshes import node_name
from cellwright.viewer.web.page import Feature, TimelineFrame
from cellwright.viewer.web.views import TAB, tool_point

_ABOVE = 0.04  # [m] of a name above its body
_AXES, _RADIUS = 0.12, 0.003  # [m]
Segments = NDArray[np.float32]
_LOOKS = " looks"  # suffix of a body that only dresses another, in recordings of versions up to 0.2
_ARROW_COLOUR = (0.86, 0.15, 0.2)
_PER_NEWTON = 0.01  # [m]
_MIN_ARROW, _MAX_ARROW = 0.015, 0.4  # [m]
_SHAFT, _HEAD, _HEAD_LENGTH = 0.003, 0.007, 0.015  # [m]
_DARK, _LIT, _OFF = (0.35, 0.55, 0.75), (0.95, 0.2, 0.1), (0.6, 0.6, 0.6)
_PLACE = ("position", "quaternion")  # keys of sensors that move
_THICKNESS = 2.0  # pixels
PATH_DURATION = 20.0  # [s] of simulation time
_PATH_STEP = 0.01  # [m] between two points
_MAX_PATH_POINTS = 800
_PATH_COLOURS = ((0.93, 0.35, 0.12), (0.1, 0.45, 0.75))


class Overlay(Feature):
    """Overlay of the scene that a box in the tab View switches on."""

    LABEL: ClassVar[str]
    HINT: ClassVar[str | None] = None
    REQUEST: ClassVar[str] = ""
    """Key to request from the frame service while it is on; empty: none."""

    def __init__(self) -> None:
        self.handles: dict[Any, Any] = {}  # of drawn items, by any key
        self._box: Any = None

    def on_scene(self, scene: Scene) -> None:
        """Offer the overlay, once, if this scene has something to draw."""
        # Handles of the previous scene are removed with it.
        self.handles = {}
        if self.is_in(scene) and self._box is None:
            with self.page.tab(TAB):
                self._box = self.page.server.gui.add_checkbox(self.LABEL, initial_value=False, hint=self.HINT)

    def is_in(self, scene: Scene) -> bool:  # noqa: ARG002
        """Return whether a scene has something to draw. Called once per scene."""
        return True

    @property
    def is_on(self) -> bool:
        """True if a browser has switched it on."""
        return self._box is not None and bool(self._box.value)

    def wants(self) -> dict[str, Any]:
        """Request the overlay while it is on."""
        return {self.REQUEST: True} if self.REQUEST and self.is_on else {}

    def on_frame(self, answer: dict[str, Any]) -> None:
        """Draw the overlay in an answer of the frame service."""
        found = answer.get(self.REQUEST) if self.is_on else None
        if found:
            self.draw(found)
        elif self.REQUEST:
            self.clear()

    def draw(self, found: Any) -> None:
        """Draw the overlay's value in an answer."""

    def clear(self) -> None:
        """Remove all drawn items."""
        for handle in self.handles.values():
            handle.remove()
        self.handles = {}

    def draw_segments(self, name: str, points: Segments, colour: tuple[float, float, float], thickness: float) -> None:
        """Draw line segments (n, 2, 3) [m], `thickness` in pixels; `name` names their node and keys its handle."""
        handle = self.handles.get(name)
        if handle is not None:
            handle.points, handle.colors = points, np.array(colour)
            return
        self.handles[name] = self.page.server.scene.add_line_segments(
            f"{self.page.root}/{name}", points, colour, thickness=thickness, thickness_units="screen"
        )


class Names(Overlay):
    """Label for each shown body."""

    LABEL = "Names"

    def show(self, moment: TimelineFrame) -> None:
        """Move the labels with the bodies."""
        scene, frame = self.page.scene, moment.frame
        named = set(_named_bodies(scene, frame)) if scene is not None and self.is_on else set()
        for body in self.handles.keys() - named:
            self.handles.pop(body).remove()
        for body in named:
            place = frame.poses[body, :3] + np.array((0.0, 0.0, _ABOVE), np.float32)
            if body in self.handles and moment.moved[body]:
                self.handles[body].position = place
            elif body not in self.handles and scene is not None:
                self.handles[body] = self.page.server.scene.add_label(
                    f"{self.page.root}/names/{body}", _short(scene.bodies[body]), position=place
                )


class Axes(Overlay):
    """Three axes for each shown body."""

    LABEL = "Frames"
    HINT = "x red, y green, z blue, 12 cm long"

    def show(self, moment: TimelineFrame) -> None:
        """Move the axes with the bodies."""
        scene = self.page.scene
        if scene is None or not self.is_on:
            self.clear()
            return
        poses = moment.frame.poses[_named_bodies(scene, moment.frame)]
        drawn = self.handles.get("axes")
        if drawn is not None and len(drawn.batched_positions) == len(poses):
            drawn.batched_positions, drawn.batched_wxyzs = poses[:, :3], poses[:, 3:]
            return
        self.clear()
        self.handles["axes"] = self.page.server.scene.add_batched_axes(
            f"{self.page.root}/frames", poses[:, 3:], poses[:, :3], axes_length=_AXES, axes_radius=_RADIUS
        )


def _named_bodies(scene: Scene, frame: SceneFrame) -> list[int]:
    """Shown bodies that have a name of their own."""
    named = enumerate(zip(scene.bodies, frame.shown.tolist(), strict=True))
    return [index for index, (name, is_shown) in named if index and is_shown and not name.endswith(_LOOKS)]


def _short(name: str) -> str:
    """Last part of a full name, as used in speech."""
    return name.replace("|", "::").rsplit("::", 1)[-1]


class Contacts(Overlay):
    """Arrow for each contact, as long as its force is strong."""

    LABEL = "Contacts and forces"
    HINT = "Arrows of 1 cm per newton; none for what sleeps, rides the belt or hangs on the cup"
    REQUEST = "contacts"

    def draw(self, found: Any) -> None:
        """Draw contacts, rows as in `contact_forces`."""
        arrows = _arrows(np.array(found, np.float32))
        if "arrows" in self.handles:
            self.handles["arrows"].points = arrows
            return
        self.handles["arrows"] = self.page.server.scene.add_arrows(
            f"{self.page.root}/contacts",
            arrows,
            _ARROW_COLOUR,
            shaft_radius=_SHAFT,
            head_radius=_HEAD,
            head_length=_HEAD_LENGTH,
        )


def _arrows(rows: Segments) -> Segments:
    """Start and end (n, 2, 3) [m] of the arrows of contacts (n, 6): they point up, away from what is below."""
    places, forces = rows[:, :3], rows[:, 3:]
    forces = np.where(forces[:, 2:] < 0, -forces, forces)
    strength = np.linalg.norm(forces, axis=1, keepdims=True)
    length = np.clip(_PER_NEWTON * strength, _MIN_ARROW, _MAX_ARROW)
    ends = places + forces / np.maximum(strength, 1e-9) * length
    return np.stack([places, ends], axis=1).astype(np.float32)


class Beams(Overlay):
    """Lines for the view of each sensor."""

    LABEL = "Sensors"
    HINT = "Field of view of each sensor, red while it detects something"
    REQUEST = "sensors"

    def __init__(self) -> None:
        super().__init__()
        self._sensors: list[dict[str, Any]] = []
        self._shown: dict[str, Any] = {}

    def is_in(self, scene: Scene) -> bool:  # noqa: ARG002
        """Return whether a scene has sensors of a known form."""
        self._sensors = [each for each in self.page.about.get("sensors", ()) if each.get("form") in _FORMS]
        return bool(self._sensors)

    @property
    def is_on(self) -> bool:
        """True if it is switched on, and there are sensors."""
        return bool(self._sensors) and super().is_on

    def draw(self, found: Any) -> None:
        """Draw readings by the names of sensors, as in `Sensor.overlay`."""
        if not self.handles:
            self._shown = {}
        for sensor in self._sensors:
            name = str(sensor["name"])
            path = f"sensors/{node_name(name)}"
            label = f"{path} name"
            if label not in self.handles:
                self.handles[label] = self.page.server.scene.add_label(
                    f"{self.page.root}/{label}", name, position=sensor["position"]
                )
            reading = found.get(name)
            if path not in self.handles or self._shown.get(name) != reading:
                self._shown[name] = reading
                place = {**sensor, **{key: reading[key] for key in _PLACE if key in reading}} if reading else sensor
                colour = _OFF if reading is None else _LIT if reading.get("sees") else _DARK
                segments = _world(place, _FORMS[sensor["form"]](sensor, reading or {}))
                self.draw_segments(path, segments, colour, _THICKNESS)


def _ranges(sensor: dict[str, Any], reading: dict[str, Any], count: int) -> list[float]:
    """Measured ranges of a sensor [m]; `count` times its maximum where none is known."""
    return [sensor["far"] if each is None else each for each in reading.get("ranges") or [None] * count]


def _beam(sensor: dict[str, Any], reading: dict[str, Any]) -> Segments:
    """Ray of a sensor, up to its range."""
    near = sensor["near"]
    return np.array([[(near, 0, 0), (near + _ranges(sensor, reading, 1)[0], 0, 0)]], np.float32)


def _cone(sensor: dict[str, Any], reading: dict[str, Any]) -> Segments:
    near, angle = sensor["near"], sensor["angle"]
    far = _ranges(sensor, reading, 1)[0]
    around = np.linspace(0, 2 * math.pi, 13)
    width = far * math.tan(angle)
    rim = np.column_stack([np.full(13, near + far), width * np.cos(around), width * np.sin(around)])
    spokes = [[(near, 0, 0), point] for point in rim[:-1:3].tolist()]
    return np.array([*np.stack([rim[:-1], rim[1:]], axis=1).tolist(), *spokes], np.float32)


def _fan(sensor: dict[str, Any], reading: dict[str, Any]) -> Segments:
    """Measured outline, and the sides of the fan."""
    lengths = np.array(_ranges(sensor, reading, 2))
    angles = np.linspace(-sensor["angle"], sensor["angle"], len(lengths))
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
    """Transform segments from a sensor's frame to the world."""
    w, *vector = sensor["quaternion"]
    across = 2 * np.cross(vector, segments)
    placed: NDArray[np.float64] = segments + w * across + np.cross(vector, across) + np.array(sensor["position"])
    found: Segments = placed.astype(np.float32)
    return found


class ToolPaths(Overlay):
    """Line behind each tool."""

    LABEL = "Tool path"

    def __init__(self) -> None:
        super().__init__()
        self._tools: list[Any] = []
        self._paths: list[deque[tuple[int, Any]]] = []

    def is_in(self, scene: Scene) -> bool:
        """Return whether a scene has tools."""
        self._tools = [tool for tool in self.page.about.get("tools", ()) if _is_tool(tool, scene)]
        self._paths = [deque(maxlen=_MAX_PATH_POINTS) for _ in self._tools]
        return bool(self._tools)

    def show(self, moment: TimelineFrame) -> None:
        """Draw the past positions of the tools."""
        if moment.is_cut or not self.is_on:
            self.clear()
        if not self.is_on:
            return
        for number, (tool, path) in enumerate(zip(self._tools, self._paths, strict=True)):
            point = tool_point(moment.frame, tool)
            now = moment.frame.time
            is_new = not path or float(np.linalg.norm(point - path[-1][1])) > _PATH_STEP
            if is_new:
                path.append((now, point))
            is_old = path[0][0] < now - PATH_DURATION * 1e9
            while path and path[0][0] < now - PATH_DURATION * 1e9:
                path.popleft()
            if is_new or is_old:
                points = np.array([point for _, point in path], np.float32).reshape(-1, 3)
                segments = np.stack([points[:-1], points[1:]], axis=1)
                colour = _PATH_COLOURS[number % len(_PATH_COLOURS)]
                self.draw_segments(f"path of tool {number + 1}", segments, colour, 3.0)

    def clear(self) -> None:
        """Forget the past positions."""
        super().clear()
        for path in self._paths:
            path.clear()


def _is_tool(tool: Any, scene: Scene) -> bool:
    return isinstance(tool, list) and len(tool) == 2 and isinstance(tool[0], int) and 0 <= tool[0] < len(scene.bodies)
