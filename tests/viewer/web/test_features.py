"""Features of the page: bodies, beams, contacts, paths, names, and views."""

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cellwright.rendering.camera import VIEWS
from cellwright.rendering.scene import Scene, SceneFrame, SceneShape, ShapeLayer, ShapeType
from cellwright.util.pose import Pose
from cellwright.viewer.web.overlays import PATH_DURATION, Axes, Beams, Contacts, Names, ToolPaths
from cellwright.viewer.web.page import Feature, TimelineFrame
from cellwright.viewer.web.scene import Bodies, Shadows, lamp_of
from cellwright.viewer.web.views import Views, views_of
from tests.viewer.web.fake import FakePage

RED = (1.0, 0.0, 0.0, 1.0)
IDENTITY = (1.0, 0.0, 0.0, 0.0)


def box(body: int, layer: ShapeLayer = ShapeLayer.BOTH, half: float = 0.1) -> SceneShape:
    return SceneShape(body, ShapeType.BOX, (half, half, half), Pose(), RED, layer)


ALIKE = Scene(
    "alike",
    ("world", "arm/hand", "bin1|gear_1", "bin1|gear_2", "bin1|gear_3", "bin1|gear_4", "touched looks"),
    (
        SceneShape(0, ShapeType.PLANE, (5.0, 5.0, 0.1), Pose(), RED, ShapeLayer.LOOKS),
        box(0),
        box(1, ShapeLayer.LOOKS, 0.2),
        box(1, ShapeLayer.TOUCH, 0.3),
        *(box(body, ShapeLayer.BOTH, 0.02) for body in (2, 3, 4, 5)),
        box(6, ShapeLayer.LOOKS, 0.4),
    ),
    (),
)


def frame(time: int = 0, hidden: tuple[int, ...] = (), **places: float) -> SceneFrame:
    """Frame with bodies by number (`b2=0.5`) at a distance along x; all others at the origin."""
    poses = np.tile(np.array([0, 0, 0, 1, 0, 0, 0], np.float32), (len(ALIKE.bodies), 1))
    for name, x in places.items():
        poses[int(name[1:]), 0] = x
    shown = np.ones(len(poses), np.bool_)
    shown[list(hidden)] = False
    return SceneFrame(time, poses, shown)


def page_with(feature: Feature, **about: Any) -> FakePage:
    page = FakePage(ALIKE, **about)
    feature.page = page  # type: ignore[assignment]
    feature.on_scene(ALIKE)
    return page


def test_bodies_of_same_shapes_are_one_node() -> None:
    page = page_with(Bodies())
    assert set(page.nodes) == {
        "/scene/bodies",
        "/scene/bodies/world",
        "/scene/bodies/arm.hand",
        "/scene/bodies/bin1|gear_1 and copies",
        "/scene/bodies/touched looks",
    }


def test_bodies_move_to_poses_and_hide() -> None:
    bodies = Bodies()
    page = page_with(bodies)
    before = frame(b1=0.5, b3=0.7, hidden=(4,))
    bodies.show(TimelineFrame.of(before))
    hand, gears = page.nodes["/scene/bodies/arm.hand"], page.nodes["/scene/bodies/bin1|gear_1 and copies"]
    assert hand.position.tolist() == [0.5, 0.0, 0.0]
    assert gears.batched_positions[1, 0] == pytest.approx(0.7)
    assert gears.batched_scales.tolist() == [[1, 1, 1], [1, 1, 1], [0, 0, 0], [1, 1, 1]]
    hand.position = "untouched"
    bodies.show(TimelineFrame.of(frame(b1=0.5, b3=0.8, hidden=(1,)), before))
    assert hand.position == "untouched"  # unchanged poses are not sent again
    assert hand.visible is False
    assert gears.batched_positions[1, 0] == pytest.approx(0.8)
    assert gears.batched_scales[2].tolist() == [1, 1, 1]


def test_collision_shapes_replace_looks() -> None:
    bodies = Bodies()
    page = page_with(bodies)
    bodies.show(TimelineFrame.of(frame(b1=0.5)))
    page.boxes["Collision shapes"].value = True
    page.boxes["Collision shapes"].clicked(None)
    assert page.nodes["/scene/touched"].visible is True
    assert page.nodes["/scene/bodies"].visible is False
    assert page.nodes["/scene/touched/arm.hand"].position.tolist() == [0.5, 0.0, 0.0]
    assert "/scene/touched/touched looks" not in page.nodes
    page.boxes["Collision shapes"].value = False
    page.boxes["Collision shapes"].clicked(None)
    assert (page.nodes["/scene/touched"].visible, page.nodes["/scene/bodies"].visible) == (False, True)


def test_large_bodies_cast_shadows_that_follow_them() -> None:
    shadows = Shadows()
    page = page_with(shadows)
    assert set(page.nodes) == {"/scene/shadows", "/scene/shadows/0", "/scene/shadows/1", "/scene/shadows/6"}
    aside = np.array(page.nodes["/scene/shadows"].position)
    assert np.linalg.norm(aside) == pytest.approx(0.03)
    assert aside @ lamp_of({}) < 0
    shadows.show(TimelineFrame.of(frame(b1=0.4, hidden=(6,))))
    assert page.nodes["/scene/shadows/1"].position[0] == pytest.approx(0.4)
    assert page.nodes["/scene/shadows/6"].visible is False


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


def test_views_of_cell_are_fixed_and_views_of_robot_show_it_whole() -> None:
    assert views_of(ALIKE, frame(), {"kind": "cell"}) is VIEWS
    found = views_of(ALIKE, frame(b1=1.0), {"kind": "robot", "tools": [[1, [0.2, 0.0, 0.0]]]})
    assert list(found) == ["front", "left", "right", "back", "hands"]
    corners = np.array([(x, y, z) for x in (-0.4, 1.2) for y in (-0.4, 0.4) for z in (-0.4, 0.4)])
    for name in ("front", "left", "right", "back"):
        view = found[name]
        across, down, deep = view.world_R_optical.T @ (corners - view.eye).T
        assert (np.abs(np.array([across, down])) / deep < math.tan(view.fov / 2)).all()
    assert found["front"].eye[0] > 1.2
    assert found["hands"].target == pytest.approx((1.2, 0.0, 0.0), abs=1e-6)


def test_view_click_moves_camera_of_clicking_browser_only() -> None:
    views = Views()
    page = page_with(views, kind="cell")
    views.show(TimelineFrame.of(frame()))
    assert page.server.initial_camera.position == VIEWS["overview"].eye
    buttons = page.boxes["Look at"]
    assert buttons.options == tuple(VIEWS)
    camera = SimpleNamespace()
    buttons.clicked(SimpleNamespace(target=SimpleNamespace(value="belt"), client=_Client(camera)))
    assert (camera.position, camera.look_at) == (VIEWS["belt"].eye, VIEWS["belt"].target)


class _Client:
    def __init__(self, camera: Any) -> None:
        self.camera = camera

    def atomic(self) -> FakePage:
        return FakePage()
