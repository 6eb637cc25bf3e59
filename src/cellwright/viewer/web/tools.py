"""The way of the tools: where they have been in the last seconds."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from cellwright.rendering.scene import Scene
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.moment import Moment
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.views import TAB, tool_point

LASTS = 20.0
"""So long [s] of simulation time the way is shown."""

_STEP = 0.01  # [m] between two points of it
_MOST = 800
_COLOURS = ((0.93, 0.35, 0.12), (0.1, 0.45, 0.75))


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
        self._ways = [deque(maxlen=_MOST) for _ in self._tools]
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
            is_new = not way or float(np.linalg.norm(point - way[-1][1])) > _STEP
            if is_new:
                way.append((now, point))
            is_old = False
            while way and way[0][0] < now - LASTS * 1e9:
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
                _COLOURS[number % len(_COLOURS)],
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
