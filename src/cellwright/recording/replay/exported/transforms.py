"""Where the bodies of a scene are, as transforms: what moved, and everything once a second.

Whoever draws transforms puts a body between the two that are next to the moment. So where a body begins to move, its
last place is said once more for the frame before, or it would seem to glide there for as long as nothing was said of
it; and what comes into play or goes out of it does so at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import NANOSECONDS
from cellwright.middleware.messages.build import transform_stamped
from cellwright.middleware.messages.standard import TFMessage, TransformStamped
from cellwright.recording.replay.exported.names import WORLD, frame_of
from cellwright.rendering.scene import Frame
from cellwright.util.pose import Pose

_WHOLE = NANOSECONDS  # simulation time after which everything is said [ns]
_OUT_OF_SIGHT = (0.0, 0.0, -1000.0, 1.0, 0.0, 0.0, 0.0)  # place [m] of what is not shown: markers cannot be hidden


class Transforms:
    """The transforms of one frame after another.

    Args:
        bodies: names of the scene's bodies, the world first.
    """

    def __init__(self, bodies: tuple[str, ...]) -> None:
        self._names = [frame_of(body, name) for body, name in enumerate(bodies)]
        self._said = np.full(len(bodies), -1)  # when each was last said [ns]
        self._whole = -_WHOLE
        self._before: Frame | None = None

    def take(self, frame: Frame) -> TFMessage | None:
        """What is to be said of the next frame; None where nothing is, or it is of another scene."""
        if len(frame.poses) != len(self._names):
            return None
        places, before, now = _places(frame), self._before, frame.time
        told = []
        due = np.ones(len(places), np.bool_)
        if before is not None:
            old = _places(before)
            moved = (places != old).any(axis=1)
            jumped = moved & (frame.shown != before.shown)
            begun = moved & ~jumped & (self._said < before.time)
            told += [self._transform(body, old[body], before.time) for body in np.flatnonzero(begun)]
            told += [self._transform(body, old[body], now - 1) for body in np.flatnonzero(jumped)]
            due = moved
        if now - self._whole >= _WHOLE:
            due, self._whole = np.ones(len(places), np.bool_), now
        due[0] = False
        told += [self._transform(body, places[body], now) for body in np.flatnonzero(due)]
        self._said[due] = now
        self._before = frame
        return TFMessage(told) if told else None

    def _transform(self, body: np.intp, place: NDArray[np.float64], time: int) -> TransformStamped:
        x, y, z, qw, qx, qy, qz = place.tolist()
        return transform_stamped(WORLD, self._names[body], Pose((x, y, z), (qw, qx, qy, qz)), time)


def _places(frame: Frame) -> NDArray[np.float64]:
    """Position and quaternion of each body (bodies, 7), far below the floor where it is not shown."""
    places = np.where(frame.shown[:, None], frame.poses.astype(np.float64), _OUT_OF_SIGHT)
    length = np.linalg.norm(places[:, 3:], axis=1, keepdims=True)
    places[:, 3:] = np.where(length > 0.0, places[:, 3:] / np.where(length > 0.0, length, 1.0), _OUT_OF_SIGHT[3:])
    return places
