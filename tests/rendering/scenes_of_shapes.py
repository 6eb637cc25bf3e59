"""Small scene: a red ball on its own body, above a grey floor."""

import numpy as np

from cellwright.rendering.scene import Scene, SceneFrame, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.worker import RenderWorker
from cellwright.util.pose import Pose
from tests.support.required import cannot_run
from tests.support.waiting import TIMEOUT

AT_HOME = Pose((0, 0, 0), (1, 0, 0, 0))
BALL = Scene(
    "ball",
    ("world", "ball"),
    (
        SceneShape(0, ShapeType.PLANE, (0, 0, 1), AT_HOME, (0.7, 0.7, 0.7, 1), ShapeLayer.BOTH),
        SceneShape(1, ShapeType.SPHERE, (0.5, 0, 0), AT_HOME, (0.9, 0.1, 0.1, 1), ShapeLayer.BOTH),
        SceneShape(1, ShapeType.BOX, (2, 2, 2), AT_HOME, (0.1, 0.9, 0.1, 1), ShapeLayer.TOUCH),
    ),
    (),
)


def ball_at(x: float, y: float, z: float, *, shown: bool = True, time: int = 0) -> SceneFrame:
    poses = np.zeros((2, 7), np.float32)
    poses[:, 3] = 1
    poses[1, :3] = x, y, z
    return SceneFrame(time, poses, np.array([True, shown]))


def skip_without_opengl(worker: RenderWorker) -> None:
    """Skip without OpenGL; in CI it is required."""
    if worker.ready.result(TIMEOUT) == "rays":
        cannot_run("no OpenGL: scripts/install-display installs it", "what OpenGL draws")
