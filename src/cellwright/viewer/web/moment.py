"""What is shown at one moment: between the frames that came, so that motion is even."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene import Frame

_DELAY = 1.5
"""Times the usual distance between two frames, by which the page is behind: one frame may come late unseen."""
_SLOWEST = 0.25  # [s]: frames that come less often than that are shown as they come
_LEAP = 0.5
"""A body that moves so far [m] between two frames, or more and faster than it did, was put there: it does not glide."""


@dataclass(frozen=True, slots=True)
class Moment:
    """What is shown.

    Attributes:
        frame: where the bodies are.
        is_cut: whether it does not follow from what was shown before: after a reset or a jump in time, and at first.
    """

    frame: Frame
    is_cut: bool


@dataclass(frozen=True, slots=True)
class _Come:
    frame: Frame
    wall: float
    run: int


class Moments:
    """Frames as they come, and what is to be shown at a time of the wall clock."""

    def __init__(self) -> None:
        self._come: deque[_Come] = deque(maxlen=8)
        self._period = 1 / 30
        self._is_cut = True
        self._shown: Frame | None = None

    def take(self, frame: Frame, *, run: int, wall: float) -> None:
        """Take a frame of a run that came at `wall` [s]."""
        if self._come:
            newest = self._come[-1]
            is_other = len(frame.poses) != len(newest.frame.poses)
            if run != newest.run or frame.time < newest.frame.time or is_other:
                self.cut()
            else:
                gap = wall - newest.wall
                if gap < _SLOWEST:
                    self._period += 0.1 * (gap - self._period)
        self._come.append(_Come(frame, wall, run))

    def cut(self) -> None:
        """What comes next does not follow from what was before."""
        self._come.clear()
        self._is_cut = True

    def at(self, wall: float) -> Moment | None:
        """What is to be shown at `wall` [s]; None when that is what was asked for last."""
        if not self._come:
            return None
        is_cut, self._is_cut = self._is_cut, False
        frame = self._frame(wall - _DELAY * self._period)
        if frame is self._shown and not is_cut:
            return None
        self._shown = frame
        return Moment(frame, is_cut)

    def _frame(self, wall: float) -> Frame:
        come = self._come
        while len(come) > 1 and come[1].wall <= wall:
            come.popleft()
        if len(come) == 1 or wall <= come[0].wall:
            return come[0].frame
        before, after = come[0], come[1]
        if after.wall - before.wall > _SLOWEST:
            return before.frame
        return between(before.frame, after.frame, (wall - before.wall) / (after.wall - before.wall))


def between(before: Frame, after: Frame, share: float) -> Frame:
    """What lies between two frames: positions on a line, directions on the way of a turn.

    Args:
        before: the first.
        after: the second, of the same scene.
        share: how far from the first to the second, 0..1.
    """
    if np.array_equal(before.poses, after.poses) and np.array_equal(before.shown, after.shown):
        return before
    poses = before.poses + np.float32(share) * (after.poses - before.poses)
    poses[:, 3:] = _turned(before.poses[:, 3:], after.poses[:, 3:], share)
    leap = np.abs(after.poses[:, :3] - before.poses[:, :3]).max(axis=1) > _LEAP
    leap |= before.shown != after.shown
    poses[leap] = before.poses[leap]
    time = round(before.time + share * (after.time - before.time))
    return Frame(time, poses, before.shown)


def _turned(before: NDArray[np.float32], after: NDArray[np.float32], share: float) -> NDArray[np.float32]:
    """Quaternions (n, 4) between others. The turns are small, so a line, made a unit one again, is close enough."""
    sign = np.where((before * after).sum(axis=1, keepdims=True) < 0, -1.0, 1.0).astype(np.float32)
    mixed = before + np.float32(share) * (sign * after - before)
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    turned: NDArray[np.float32] = np.where(length > 1e-6, mixed / np.maximum(length, 1e-6), after).astype(np.float32)
    return turned
