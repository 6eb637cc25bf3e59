"""Streams of frames: what the frame service sends to a page without further requests."""

import json
import math
from collections.abc import Callable
from typing import Any

from cellwright.middleware.wire.frames import data_payload
from cellwright.rendering.scene.scene import SceneFrame
from cellwright.viewer.services.control import PanelSource

PANEL_PERIOD = 0.25
"""Wall time [s] between two panels of a stream; a frame comes with each of them even while time stands."""


class StreamedFrames:
    """Frames and panels of all streams: each is made and encoded once for those that it fits.

    Args:
        newest: returns the current frame, with its number.
        details: returns the JSON with it, for a request.
        panel: the panel service; None if there is none.
    """

    def __init__(
        self,
        newest: Callable[[], tuple[int, SceneFrame]],
        details: Callable[[dict[str, Any]], dict[str, Any]],
        panel: PanelSource | None,
    ) -> None:
        self._newest, self._details = newest, details
        self._panel_source = panel
        self._at = self._panel_due = -math.inf
        self._constants: object = None
        self._payloads: dict[tuple[object, ...], bytes] = {}
        self.newest: tuple[int, SceneFrame]
        """The newest frame, with its number."""
        self.panels = 0
        """Number of panels so far."""
        self._panel = ""

    def look(self, at: float) -> None:
        """Take the current frame, and from time to time a panel, at a wall time [s]; once for all streams."""
        if at == self._at:
            return
        self._at = at
        self._payloads.clear()
        self.newest = self._newest()
        if at >= self._panel_due:
            self._panel_due = at + PANEL_PERIOD
            self.panels += 1
            if self._panel_source is not None:
                panel = self._panel_source({"robot": self._constants})
                self._constants = panel.get("digest")
                self._panel = f', "panel": {json.dumps(panel)}'

    def payload(self, before: tuple[int, SceneFrame] | None, request: dict[str, Any], *, has_panel: bool) -> bytes:
        """Return the newest frame as the payload of DATA.

        Args:
            before: number and frame that the client has; None if it has none.
            request: names the overlays.
            has_panel: True to add the newest panel.
        """
        overlays = request.get("contacts") is True, request.get("sensors") is True
        key = None if before is None else before[0], overlays, has_panel
        found = self._payloads.get(key)
        if found is None:
            text = json.dumps(self._details(request))
            if has_panel:
                text = f"{text[:-1]}{self._panel}}}"
            found = self._payloads[key] = data_payload(
                text, self.newest[1].encode(None if before is None else before[1])
            )
        return found


class FrameStream:
    """Stream of frames to one client; see `AnswerStream`."""

    def __init__(self, streamed: StreamedFrames, request: dict[str, Any], ahead: int) -> None:
        self.ahead = ahead
        self._streamed = streamed
        self._request = request
        self._sent: tuple[int, SceneFrame] | None = None
        self._panel = 0

    def next(self, at: float) -> bytes | None:
        """See `AnswerStream`."""
        streamed = self._streamed
        streamed.look(at)
        has_panel = self._panel != streamed.panels
        if not has_panel and self._sent is not None and self._sent[0] == streamed.newest[0]:
            return None
        payload = streamed.payload(self._sent, self._request, has_panel=has_panel)
        self._sent, self._panel = streamed.newest, streamed.panels
        return payload
