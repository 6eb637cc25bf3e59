"""Camera views: the first one, and one per button."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.camera import Camera
from cellwright.rendering.scene import SEEN, Scene, SceneFrame, ShapeType
from cellwright.rendering.views import gear2017_views
from cellwright.util.errors import UsageError
from cellwright.viewer.web.meshes import surface
from cellwright.viewer.web.page import Feature, TimelineFrame

TAB = "View"  # the tab for all that changes the view, and nothing else

_FOV = math.radians(35)
_ROOM = 1.25  # factor on the viewed size, for a margin
_SIDES = {"front": (-28, 12), "left": (62, 12), "right": (-118, 12), "back": (180, 16)}  # [degrees] about z; above
_ABOVE = 50  # [degrees], for the hands
_NEAR, _FAR = 0.02, 150.0  # [m]


class Views(Feature):
    """Buttons for cameras, each with a whole object in its picture."""

    def __init__(self) -> None:
        self._views: Mapping[str, Camera] = {}
        self._buttons: Any = None
        self._is_due = True

    def on_scene(self, scene: Scene) -> None:  # noqa: ARG002
        """Update the views for another scene."""
        self._is_due = True

    def show(self, moment: TimelineFrame) -> None:
        """Make the views with the first frame, which has the poses."""
        page = self.page
        if not self._is_due or page.scene is None:
            return
        self._is_due = False
        views = views_of(page.scene, moment.frame, page.about)
        if dict(views) == dict(self._views):
            return
        self._views = views
        first, camera = next(iter(views.values())), page.server.initial_camera
        camera.position, camera.look_at, camera.up, camera.fov = first.eye, first.target, first.up, first.fov
        camera.near, camera.far = _NEAR, _FAR
        if self._buttons is not None:
            self._buttons.remove()
        with page.tab(TAB):
            self._buttons = page.server.gui.add_button_group("Look at", tuple(views), order=0.0)
        self._buttons.on_click(self._clicked)

    def _clicked(self, event: Any) -> None:
        view = self._views.get(str(event.target.value))
        if view is not None and event.client is not None:
            camera = event.client.camera
            with event.client.atomic():
                camera.position, camera.look_at = view.eye, view.target
                camera.up_direction, camera.fov = view.up, view.fov


def views_of(scene: Scene, frame: SceneFrame, about: Mapping[str, Any]) -> Mapping[str, Camera]:
    """Cameras by name for a frame; the first is the initial one. `about` has its `kind` and `tools`."""
    # a recording says nothing about itself, and one of 2017's cell names no views
    if scene.views or about.get("kind", "") == "cell" or any(name.startswith("agv") for name in scene.bodies):
        return scene.views or gear2017_views()
    points = _corners(scene, frame)
    heading = frame.pose(1).yaw if len(frame.poses) > 1 else 0.0  # of the first body that may move, from x
    sides = {name: (math.radians(turn), math.radians(tilt)) for name, (turn, tilt) in _SIDES.items()}
    found = {name: _on(points, heading + turn, tilt) for name, (turn, tilt) in sides.items()}
    places = [tool_point(frame, tool) for tool in about.get("tools", ())]
    if places:
        found["hands"] = _on(_around(np.array(places)), heading, math.radians(_ABOVE))
    return found


def _corners(scene: Scene, frame: SceneFrame) -> NDArray[np.float64]:
    """Corners of boxes (n, 3) [m] around bodies that can move or stand on the ground; a hidden one has one corner."""
    found = []
    for shape in scene.shapes:
        if shape.layer not in SEEN or shape.form is ShapeType.PLANE or not frame.shown[shape.body]:
            continue
        points = surface(shape, scene).points
        if len(points):
            low, high = points.min(axis=0), points.max(axis=0)
            box = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
            found.append(frame.placed(shape.body, box))
    return np.concatenate(found) if found else _around(np.zeros((1, 3)))


def _around(places: NDArray[np.float64], room: float = 0.25) -> NDArray[np.float64]:
    steps = room * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    around: NDArray[np.float64] = (places[:, None] + steps[None]).reshape(-1, 3)
    return around


def _on(points: NDArray[np.float64], turn: float, tilt: float) -> Camera:
    """Camera that looks at points from a side, so far away that they fill most of the picture."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - middle, axis=1).max())
    back = np.array([math.cos(tilt) * math.cos(turn), math.cos(tilt) * math.sin(turn), math.sin(tilt)])
    eye = middle + _ROOM * max(radius, 0.05) / math.tan(_FOV / 2) * back
    (x, y, z), (a, b, c) = eye.tolist(), middle.tolist()
    try:
        return Camera((x, y, z), (a, b, c), fov=_FOV)
    except UsageError:  # recorded positions may be anywhere
        return gear2017_views()["overview"]


def tool_point(frame: SceneFrame, tool: Any) -> NDArray[np.float64]:
    """Position (3,) [m] of a tool, [body, [x, y, z]]."""
    body, place = tool
    point: NDArray[np.float64] = frame.placed(int(body), np.array([place], np.float64))[0]
    return point
