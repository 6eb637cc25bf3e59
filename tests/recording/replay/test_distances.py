"""Distances and contacts in frames of small scenes, whose values follow from the shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from cellwright.recording.replay.distances import BodyDistances, Clearance, Contact
from cellwright.rendering.scene.scene import Scene, SceneFrame, SceneShape, ShapeLayer, ShapeType
from cellwright.util.errors import RecordingError, UnknownNameError, UsageError
from cellwright.util.pose import Pose

RED = (1.0, 0.0, 0.0, 1.0)
BALL = SceneShape(1, ShapeType.SPHERE, (0.1, 0.0, 0.0), Pose(), RED, ShapeLayer.BOTH)
FLOOR = SceneShape(0, ShapeType.PLANE, (0.0, 0.0, 1.0), Pose(), RED, ShapeLayer.BOTH, static_body="world")
WALL = SceneShape(0, ShapeType.BOX, (0.5, 2.0, 2.0), Pose((2.0, 0.0, 0.0)), RED, ShapeLayer.TOUCH, static_body="wall")
SHADE = SceneShape(0, ShapeType.BOX, (9.0, 9.0, 9.0), Pose(), RED, ShapeLayer.LOOKS, static_body="shade")
BLOCK = SceneShape(2, ShapeType.BOX, (0.1, 0.1, 0.1), Pose(), RED, ShapeLayer.BOTH)
SCENE = Scene("small", ("world", "ball", "block"), (BLOCK, WALL, SHADE, BALL, FLOOR), ())
EVERYTHING = ["ball", "block", "floor", "wall"]


def frames(*balls: tuple[float, float, float], block: Sequence[float] = (-5.0, 0.0, 3.0)) -> list[SceneFrame]:
    """Return a frame each 40 ms, with the positions of the ball [m]."""
    found = []
    for number, ball in enumerate(balls):
        poses = np.zeros((3, 7), np.float32)
        poses[:, 3] = 1.0
        poses[1, :3], poses[2, :3] = ball, block
        found.append(SceneFrame(number * 40_000_000, poses, np.ones(3, np.bool_)))
    return found


def test_names_are_those_of_shapes_that_touch() -> None:
    assert sorted(BodyDistances(SCENE).names) == EVERYTHING
    older = Scene("small", SCENE.bodies, tuple(replace(shape, static_body="") for shape in SCENE.shapes), ())
    assert sorted(BodyDistances(older).names) == ["ball", "block", "static"]


def test_seen_shapes_stand_for_bodies_without_others_on_request() -> None:
    looks = [replace(shape, layer=ShapeLayer.LOOKS) for shape in (BLOCK, replace(BALL, size=(0.5, 0.0, 0.0)))]
    distances = BodyDistances(replace(SCENE, shapes=(BALL, *looks, FLOOR)), seen_too=True)
    assert sorted(distances.names) == ["ball", "block", "floor"]
    found = distances.clearance(frames((0.0, 0.0, 1.0)), ["ball"], ["floor"])
    assert found is not None
    assert found.distance == pytest.approx(0.9, abs=1e-6), "of the small ball, which touches"


def test_bodies_are_selected_by_names_and_patterns() -> None:
    distances = BodyDistances(SCENE)
    assert distances.select("b*") == {"ball", "block"}
    assert distances.select(["ball", "wa*"]) == {"ball", "wall"}
    with pytest.raises(UnknownNameError, match="unknown body 'bal'; did you mean ball"):
        distances.select(["wall", "bal"])


def test_clearance_is_the_least_over_frames_with_its_time_and_bodies() -> None:
    distances = BodyDistances(SCENE)
    found = distances.clearance(frames((0.0, 0.0, 1.0), (1.2, 0.0, 1.0), (0.5, 0.0, 0.4)), ["ball"], ["wall", "floor"])
    assert found is not None
    assert found.distance == pytest.approx(0.2, abs=1e-6)
    assert (found.time, found.one, found.other) == (0.04, "ball", "wall")


def test_clearance_to_the_floor_is_exact() -> None:
    found = BodyDistances(SCENE).clearance(frames((0.3, -0.2, 0.125)), ["ball"], ["floor"])
    assert found is not None
    assert found.distance == pytest.approx(0.025, abs=1e-6)


def test_clearance_is_zero_at_the_first_touch() -> None:
    found = BodyDistances(SCENE).clearance(
        frames((0.0, 0.0, 1.0), (0.0, 0.0, 0.09), (0.0, 0.0, 0.01)), ["ball"], ["floor"]
    )
    assert found == Clearance(0.0, 0.04, "ball", "floor")


def test_turned_boxes_are_measured_at_their_corners() -> None:
    (frame,) = frames((-5.0, -5.0, 3.0), block=(1.2, 0.0, 1.0))
    frame.poses[2, 3:] = np.cos(np.pi / 8), 0.0, 0.0, np.sin(np.pi / 8)  # by 45 degrees about z
    found = BodyDistances(SCENE).clearance([frame], ["block"], ["wall"])
    assert found is not None
    assert found.distance == pytest.approx(1.5 - 1.2 - 0.1 * np.sqrt(2), abs=1e-5)


def test_contact_lasts_from_its_first_frame_to_its_last() -> None:
    heights = [1.0, 0.1, 0.09, 0.5, 0.1, 0.1]
    found = BodyDistances(SCENE).contacts(frames(*((0.0, 0.0, z) for z in heights)), ["ball"], ["floor", "wall"])
    assert found == (Contact("ball", "floor", 0.04, 0.08), Contact("ball", "floor", 0.16, 0.2))
    assert found[0].duration == pytest.approx(0.04)


def test_bodies_a_millimetre_apart_do_not_touch() -> None:
    assert BodyDistances(SCENE).contacts(frames((0.0, 0.0, 0.101)), ["ball"], ["floor"]) == ()


def test_pair_in_both_groups_counts_once_and_static_bodies_never() -> None:
    (found,) = BodyDistances(SCENE).contacts(frames((0.0, 0.0, 1.0), block=(0.15, 0.0, 1.0)), EVERYTHING, EVERYTHING)
    assert {found.one, found.other} == {"ball", "block"}, "the wall stands in the floor"


@pytest.mark.parametrize(("one", "other"), [(["ball"], ["ball"]), (["wall"], ["floor"]), (EVERYTHING, [])])
def test_groups_without_a_pair_that_moves_are_refused(one: list[str], other: list[str]) -> None:
    distances = BodyDistances(SCENE)
    for ask in (distances.contacts, distances.clearance):
        with pytest.raises(UsageError, match="no pair of the two groups can move"):
            ask(frames((0.0, 0.0, 1.0)), one, other)


def test_hidden_body_touches_nothing() -> None:
    (frame,) = frames((0.0, 0.0, 0.05))
    frame.shown[1] = False
    distances = BodyDistances(SCENE)
    assert distances.contacts([frame], ["ball"], ["floor"]) == ()
    assert distances.clearance([frame], ["ball"], ["floor"]) is None


def test_frame_of_another_scene_is_refused() -> None:
    frame = SceneFrame(0, np.zeros((2, 7), np.float32), np.ones(2, np.bool_))
    with pytest.raises(RecordingError, match="another scene"):
        BodyDistances(SCENE).contacts([frame], ["ball"], ["floor"])
