"""Overlays of the page: beams, contacts, tool paths, names and frames."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from cellwright.viewer.web.overlays import PATH_DURATION, Axes, Beams, Contacts, Names, ToolPaths
from cellwright.viewer.web.page import Feature, TimelineFrame
from tests.viewer.web.fake import ALIKE, IDENTITY, FakePage, frame, page_with

SENSORS = [
    {"name": "beam", "form": "beam", "position": (1, 0, 0), "quaternion": IDENTITY, "near": 0.1, "far": 1.0},
    {"name": "c", "form": "cone", "position": (0, 0, 1), "quaternion": IDENTITY, "near": 0, "far": 0.2, "angle": 0.1},
    {"name": "l", "form": "fan", "position": (0, 0, 0), "quaternion": IDENTITY, "near": 0, "far": 0.7, "angle": 0.2},
    {
        "name": "v",
        "form": "frustum",
        "position": (0, 0, 2),
        "near": 0.2,
        "far": 0.8,
        "angle": 0.5,
        "aspect": 1.5,
        "quaternion": (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0),
    },
    {"name": "other", "form": "other", "position": (0, 0, 0), "quaternion": IDENTITY},
]


def test_beams_are_requested_and_drawn_while_switched_on() -> None:
    beams = Beams()
    page = page_with(beams, sensors=SENSORS)
    assert beams.wants() == {}
    page.boxes["Sensors"].value = True
    assert beams.wants() == {"sensors": True}
    found = {
        "beam": {"sees": True, "ranges": [0.4]},
        "c": {"sees": False, "ranges": [0.2]},
        "l": {"sees": False, "ranges": [None, 0.5, None]},
        "v": None,
    }
    beams.on_frame({"sensors": found})
    lines = {name.removeprefix("/scene/sensors/"): node for name, node in page.nodes.items()}
    assert set(lines) == {name + more for name in ("beam", "c", "l", "v") for more in ("", " name")}
    np.testing.assert_allclose(lines["beam"].points, [[(1.1, 0, 0), (1.5, 0, 0)]], atol=1e-6)
    assert lines["beam"].colors != lines["c"].colors
    assert lines["v"].points[..., 2].max() == pytest.approx(1.8)  # it points down
    assert lines["v"].points[..., 2].min() == pytest.approx(1.2)
    found["beam"] = {"sees": False, "ranges": [None]}
    beams.on_frame({"sensors": found})
    np.testing.assert_allclose(lines["beam"].points, [[(1.1, 0, 0), (2.1, 0, 0)]], atol=1e-6)
    page.boxes["Sensors"].value = False
    beams.on_frame({})
    assert page.nodes == {}


def test_contact_arrows_are_as_long_as_forces() -> None:
    contacts = Contacts()
    page = page_with(contacts)
    assert contacts.wants() == {}
    page.boxes["Contacts and forces"].value = True
    assert contacts.wants() == {"contacts": True}
    contacts.on_frame({"contacts": [[1, 2, 3, 0, 0, -10], [0, 0, 0, 1000, 0, 0], [0, 0, 0, 0, 0, 0.01]]})
    points = page.nodes["/scene/contacts"].points
    np.testing.assert_allclose(points[0], [(1, 2, 3), (1, 2, 3.1)], atol=1e-6)
    assert np.linalg.norm(points[1, 1] - points[1, 0]) == pytest.approx(0.4)
    assert np.linalg.norm(points[2, 1] - points[2, 0]) == pytest.approx(0.015)
    contacts.on_frame({"contacts": []})
    assert page.nodes == {}


def test_tool_path_spans_last_seconds() -> None:
    paths = ToolPaths()
    page = page_with(paths, tools=[[1, [0.0, 0.0, 0.1]], ["nonsense", 2], [99, [0, 0, 0]]])
    page.boxes["Tool path"].value = True
    for second in range(40):
        paths.show(TimelineFrame.of(frame(second * 10**9, b1=0.1 * second), frame() if second else None))
    points = page.nodes["/scene/path of tool 1"].points
    assert len(points) == PATH_DURATION
    np.testing.assert_allclose(points[-1], [(3.8, 0, 0.1), (3.9, 0, 0.1)], atol=1e-5)
    paths.show(TimelineFrame.of(frame(0, b1=0.0)))
    assert "/scene/path of tool 1" not in page.nodes or len(page.nodes["/scene/path of tool 1"].points) == 0


def show(features: Sequence[Feature], moment: TimelineFrame) -> None:
    for feature in features:
        feature.show(moment)


def test_names_and_frames_of_shown_bodies_are_drawn() -> None:
    page = FakePage(ALIKE)
    overlays = (Names(), Axes())
    for overlay in overlays:
        overlay.page = page  # type: ignore[assignment]
        overlay.on_scene(ALIKE)
    show(overlays, TimelineFrame.of(frame()))
    assert page.nodes == {}
    page.boxes["Names"].value = page.boxes["Frames"].value = True
    show(overlays, TimelineFrame.of(frame(b2=0.5, hidden=(3,)), frame()))
    texts = {node.text for name, node in page.nodes.items() if "/names/" in name}
    assert texts == {"arm/hand", "gear_1", "gear_3", "gear_4"}
    assert len(page.nodes["/scene/frames"].batched_positions) == 4
    show(overlays, TimelineFrame.of(frame(b2=0.6), frame()))
    assert len(page.nodes["/scene/frames"].batched_positions) == 5
    assert page.nodes["/scene/names/2"].position[0] == pytest.approx(0.6)
    page.boxes["Names"].value = page.boxes["Frames"].value = False
    show(overlays, TimelineFrame.of(frame(b2=0.7), frame()))
    assert page.nodes == {}
