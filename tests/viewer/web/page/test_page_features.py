"""Features of a page: one that raises is dropped, and the others stay."""

from __future__ import annotations

import logging
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.viewer.web.connection import AwayError, ServerConnection
from cellwright.viewer.web.page import Feature, Page, TimelineFrame
from cellwright.viewer.web.poller import NewFrame, NewPanel, NewScene

SCENE = Scene("a", ("world",), (), ())
FRAME = SceneFrame(0, np.array([[0, 0, 0, 1, 0, 0, 0]], np.float32), np.array([True]))
ANSWER = NewFrame(0.0, FRAME, {"run": 0})


class Sound(Feature):
    """Feature that records its calls."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def on_scene(self, scene: Scene) -> None:
        self._note("on_scene")

    def wants(self) -> dict[str, Any]:
        self._note("wants")
        return {type(self).__name__: True}

    def show(self, moment: TimelineFrame) -> None:
        self._note("show")

    def on_frame(self, answer: dict[str, Any]) -> None:
        self._note("on_frame")

    def panel(self, panel: dict[str, Any]) -> None:
        self._note("panel")

    def on_disconnect(self, reason: str) -> None:
        self._note("on_disconnect")

    def _note(self, name: str) -> None:
        self.calls.append(name)


class Broken(Sound):
    """Feature that fails in one method.

    Args:
        at: name of the method.
    """

    def __init__(self, at: str) -> None:
        super().__init__()
        self._at = at

    def _note(self, name: str) -> None:
        super()._note(name)
        if name == self._at:
            raise ZeroDivisionError(name)


@pytest.mark.parametrize("at", ["on_scene", "wants", "show", "on_frame", "panel", "on_disconnect"])
def test_failing_feature_is_removed_and_others_stay(at: str, caplog: pytest.LogCaptureFixture) -> None:
    broken, sound = Broken(at), Sound()
    page = Page(MagicMock(), ServerConnection(("127.0.0.1", 1)), (broken, sound))
    page._poller.is_watched = True
    with caplog.at_level(logging.ERROR):
        for _ in range(2):
            overlays = page._wants()
            for result in (NewScene(SCENE, {}), ANSWER, NewPanel({"kind": "cell"}), AwayError("gone"), ANSWER):
                page._take(result)
            page._show(TimelineFrame.of(FRAME, FRAME))
    assert broken.calls[-1] == at
    assert broken.calls.count(at) == 1, "it is asked nothing more"
    assert sound.calls[: len(sound.calls) // 2] == sound.calls[len(sound.calls) // 2 :]
    assert page.features == (sound,)
    assert overlays == {"Sound": True}
    assert [record.getMessage() for record in caplog.records] == ["Broken failed and was removed from the page"]
