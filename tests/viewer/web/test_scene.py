"""Bodies and shadows on the page: their shapes, places, and what hides them."""

import numpy as np
import pytest

from cellwright.viewer.web.page import TimelineFrame
from cellwright.viewer.web.scene import Bodies, Shadows, lamp_of
from tests.viewer.web.fake import frame, page_with


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
