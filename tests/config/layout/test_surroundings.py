"""Surroundings of the devices: moved with the layout."""

import math

import pytest

from cellwright.config.layout.surroundings import Block, FloorLine, Place, Structure, View
from cellwright.util.pose import Pose

BY = Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2))


def test_structure_moves_and_its_boxes_stay_in_its_frame() -> None:
    block = Block(Pose((0.0, 1.0, 0.5)), (0.1, 0.2, 1.0))
    moved = Structure("post", Pose((1.0, 0.0, 0.0)), (block,), (block,)).moved(BY)
    assert (moved.boxes, moved.drawn) == ((block,), (block,))
    assert moved.pose.transform(block.middle.position) == pytest.approx((1.0, 2.0, 0.5))


def test_lines_views_and_places_move() -> None:
    assert FloorLine(Pose((1.0, 0.0, 0.0)), (2.0, 0.1)).moved(BY).middle.position == pytest.approx((2.0, 2.0, 0.0))
    assert Place("aside", Pose((0.0, 1.0, 0.7))).moved(BY).pose.position == pytest.approx((1.0, 1.0, 0.7))
    view = View("all", (-1.0, 0.0, 2.0), (0.0, 0.0, 0.5), 0.8).moved(BY)
    assert view.position == pytest.approx((2.0, 0.0, 2.0))
    assert view.target == pytest.approx((2.0, 1.0, 0.5))
