"""Views of the page: fixed ones of a cell, and those that show a robot whole."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cellwright.rendering.views import gear2017_views
from cellwright.viewer.web.page import TimelineFrame
from cellwright.viewer.web.views import Views, views_of
from tests.viewer.web.fake import ALIKE, FakePage, frame, page_with


def test_views_of_cell_are_fixed_and_views_of_robot_show_it_whole() -> None:
    assert views_of(ALIKE, frame(), {"kind": "cell"}) is gear2017_views()
    found = views_of(ALIKE, frame(b1=1.0), {"kind": "robot", "tools": [[1, [0.2, 0.0, 0.0]]]})
    assert list(found) == ["front", "left", "right", "back", "hands"]
    corners = np.array([(x, y, z) for x in (-0.4, 1.2) for y in (-0.4, 0.4) for z in (-0.4, 0.4)])
    for name in ("front", "left", "right", "back"):
        view = found[name]
        across, down, deep = view.world_R_optical.T @ (corners - view.eye).T
        assert (np.abs(np.array([across, down])) / deep < math.tan(view.fov / 2)).all()
    assert found["front"].eye[0] > 1.2
    assert found["hands"].target == pytest.approx((1.2, 0.0, 0.0), abs=1e-6)


def test_views_of_own_cell_are_those_of_its_scene() -> None:
    own = {"overview": gear2017_views()["bins"], "tray1": gear2017_views()["agv1"]}
    for about in ({"kind": "cell"}, {}):  # a recording says nothing about itself
        assert views_of(replace(ALIKE, views=own), frame(), about) == own


def test_view_click_moves_camera_of_clicking_browser_only() -> None:
    views = Views()
    page = page_with(views, kind="cell")
    views.show(TimelineFrame.of(frame()))
    assert page.server.initial_camera.position == gear2017_views()["overview"].eye
    buttons = page.boxes["Look at"]
    assert buttons.options == tuple(gear2017_views())
    camera = SimpleNamespace()
    buttons.clicked(SimpleNamespace(target=SimpleNamespace(value="belt"), client=_Client(camera)))
    assert (camera.position, camera.look_at) == (gear2017_views()["belt"].eye, gear2017_views()["belt"].target)


class _Client:
    def __init__(self, camera: Any) -> None:
        self.camera = camera

    def atomic(self) -> FakePage:
        return FakePage()
