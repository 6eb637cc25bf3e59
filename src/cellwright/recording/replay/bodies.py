"""Bodies in recorded frames: how fast they are, and which part a gripper holds."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from cellwright.config.layout.arms import HOLDERS
from cellwright.config.ur10 import GRIPPER, UR10
from cellwright.engine.clock import NANOSECONDS
from cellwright.recording.plots.tracks import Span
from cellwright.recording.replay.distances import BodyDistances
from cellwright.rendering.scene import Scene, SceneFrame


def held_parts(
    begun: Iterable[tuple[Span, SceneFrame | None]], scene: Scene, distances: BodyDistances
) -> tuple[Span, ...]:
    """Return the periods in which the gripper holds a part, labelled with the part: the body that is nearest to it.

    Args:
        begun: periods, each with its first frame; None if there is none.
        scene: the scene of the frames.
        distances: of its bodies.
    """
    cup = next((name for name in scene.bodies if name.rpartition("/")[2] in HOLDERS.values()), GRIPPER)
    prefix = cup[: cup.rfind("/") + 1]
    arm = {name for name in scene.bodies if prefix and name.startswith(prefix)} or UR10.links
    others = [name for name in distances.names if name not in arm and name in scene.bodies]
    found = []
    for span, frame in begun:
        nearest = frame and distances.clearance([frame], [cup], others)
        found.append(Span(span.begin, span.end, nearest.other if nearest else ""))
    return tuple(found)


def speeds(frames: Iterable[SceneFrame], body: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the times [s] of the later frame of each two, and the mean speeds [m/s] of a body's origin in between.

    Only frames that both show the body count: one that comes into play has not moved there.

    Args:
        frames: the frames, in order.
        body: index of the body in the scene.
    """
    found = [(frame.time, *frame.poses[body, :3].tolist(), frame.shown[body]) for frame in frames]
    rows = np.array(found, np.float64).reshape(-1, 5)
    times, steps = rows[:, 0] / NANOSECONDS, np.diff(rows[:, 1:4], axis=0)
    known = (np.diff(times) > 0) & (rows[1:, 4] > 0) & (rows[:-1, 4] > 0)
    return times[1:][known], np.linalg.norm(steps[known], axis=1) / np.diff(times)[known]
