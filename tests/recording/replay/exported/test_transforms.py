"""Poses of the bodies, as a tool interpolates them from the exported transforms."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.middleware.messages.standard import TFMessage
from cellwright.recording.replay.exported import Transforms
from cellwright.rendering.scene import SceneFrame

PERIOD = 40_000_000  # [ns]
BODIES = ("world", "cart", "ball")
UNTURNED = (1.0, 0.0, 0.0, 0.0)

Place = tuple[float, bool]


def frame(number: int, places: list[Place]) -> SceneFrame:
    """Return a frame of the cart and the ball, with the x coordinate and the visibility of each."""
    poses = np.array([(0, 0, 0, *UNTURNED), *((x, 0, 0, *UNTURNED) for x, _ in places)], np.float32)
    return SceneFrame(number * PERIOD, poses, np.array([True, *(shown for _, shown in places)]))


class Buffer:
    """Transform buffer of a tool, with interpolation."""

    def __init__(self, messages: list[TFMessage]) -> None:
        self._kept: dict[str, list[tuple[int, NDArray[np.float64]]]] = {}
        for message in messages:
            for each in message.transforms:
                assert each.header.frame_id == "world"
                moved = each.transform.translation
                entry = nanoseconds(each.header.stamp), np.array((moved.x, moved.y, moved.z))
                self._kept.setdefault(each.child_frame_id, []).append(entry)
        for entries in self._kept.values():
            entries.sort(key=lambda entry: entry[0])

    def find(self, body: str, time: int) -> NDArray[np.float64]:
        """Return a body's position at a time [ns], in the world [m]; outside the transforms the nearest one's."""
        entries = self._kept[f"cellwright/{body}"]
        times = [entry[0] for entry in entries]
        after = entries[min(bisect_left(times, time), len(times) - 1)]
        before = entries[max(bisect_right(times, time) - 1, 0)]
        share = 0.0 if after[0] == before[0] else (time - before[0]) / (after[0] - before[0])
        return before[1] + share * (after[1] - before[1])


places = st.tuples(st.sampled_from((0.0, 0.5, 1.0)), st.booleans())
runs = st.lists(st.lists(places, min_size=2, max_size=2), min_size=1, max_size=60)


@given(runs)
def test_transforms_at_frame_equal_recorded_poses(run: list[list[Place]]) -> None:
    transforms = Transforms(BODIES)
    buffer = Buffer([message for number, each in enumerate(run) if (message := transforms.take(frame(number, each)))])
    for number, each in enumerate(run):
        for body, (x, shown) in zip(BODIES[1:], each, strict=True):
            found = buffer.find(body, number * PERIOD)
            assert found.tolist() == ([x, 0.0, 0.0] if shown else [0.0, 0.0, -1000.0])


@given(runs)
def test_transforms_between_frames_are_interpolated(run: list[list[Place]]) -> None:
    transforms = Transforms(BODIES)
    buffer = Buffer([message for number, each in enumerate(run) if (message := transforms.take(frame(number, each)))])
    for number, (one, other) in enumerate(pairwise(run)):
        for body, (x0, shown0), (x1, shown1) in zip(BODIES[1:], one, other, strict=True):
            found = buffer.find(body, number * PERIOD + PERIOD // 2)
            if shown0 and shown1:
                assert found[0] == pytest.approx((x0 + x1) / 2)
            else:
                assert found.tolist() == ([x0, 0.0, 0.0] if shown0 else [0.0, 0.0, -1000.0])


@given(runs)
def test_one_second_of_transforms_has_all_bodies(run: list[list[Place]]) -> None:
    transforms = Transforms(BODIES)
    messages = [transforms.take(frame(number, each)) for number, each in enumerate(run)]
    for number, each in enumerate(run):
        recent = [message for message in messages[max(0, number - 25) : number + 1] if message is not None]
        for body, (x, shown) in zip(BODIES[1:], each, strict=True):
            assert Buffer(recent).find(body, number * PERIOD)[0] == (x if shown else 0.0)


def test_standing_bodies_are_sent_once_a_second() -> None:
    transforms = Transforms(BODIES)
    message = [transforms.take(frame(number, [(0.0, True), (1.0, False)])) for number in range(51)]
    assert [number for number, each in enumerate(message) if each is not None] == [0, 25, 50]


def test_frame_of_other_scene_is_skipped() -> None:
    assert Transforms(("world", "cart")).take(frame(0, [(0.0, True), (1.0, True)])) is None


def test_zero_quaternion_becomes_identity() -> None:
    poses = np.zeros((2, 7), np.float32)
    message = Transforms(("world", "cart")).take(SceneFrame(0, poses, np.array([True, True])))
    assert message is not None
    turn = message.transforms[0].transform.rotation
    assert (turn.w, turn.x, turn.y, turn.z) == UNTURNED
