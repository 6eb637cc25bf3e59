"""Small scenes for the tests of pictures."""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.camera import Camera

FLOOR = '<geom name="floor" type="plane" size="20 20 .1" rgba=".5 .5 .5 1" group="1"/>'


def scene(world: str, assets: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a model with this worldbody, and its state with all positions computed."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian"/><asset>{assets}</asset><worldbody>{world}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def clutter(seed: int, count: int = 40) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Shapes of every kind at random within two metres of the origin, some in groups that pictures leave out."""
    rng = np.random.default_rng(seed)
    points = " ".join(f"{v:.4f}" for v in rng.normal(size=90) * 0.15)
    sizes = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}
    world = FLOOR.replace("/>", ' pos="0 0 -2.5"/>')
    for _ in range(count):
        kind = rng.choice([*sizes, "mesh"])
        size = " ".join(f"{v:.4f}" for v in rng.uniform(0.02, 0.4, sizes.get(kind, 0)))
        shape = 'mesh="stone"' if kind == "mesh" else f'size="{size}"'
        x, y, z = rng.uniform(-2, 2, 3)
        roll, pitch, yaw = rng.uniform(-3, 3, 3)
        world += (
            f'<body pos="{x} {y} {z}" euler="{roll} {pitch} {yaw}"><freejoint/>'
            f'<geom type="{kind}" {shape} group="{rng.choice([1, 2, 3])}"/></body>'
        )
    return scene(world, f'<mesh name="stone" vertex="{points}"/>')


def unit_vectors(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Directions (count, 3), evenly over the sphere."""
    vectors = rng.normal(size=(count, 3))
    unit: NDArray[np.float64] = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit


def project(camera: Camera, points: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """Project `points` (n, 3) of the world [m] to (n, 3) of column, row and depth [m] along the line of sight.

    A point beside the picture has pixel coordinates outside it. A point in the camera's plane or behind it has a depth
    of zero or less, and NaN for column and row.
    """
    optical = (points - np.asarray(camera.eye)) @ camera.world_R_optical
    depth = np.where(optical[:, 2] > 0, optical[:, 2], np.nan)
    slope = 2 * math.tan(camera.fov / 2) / height
    column = optical[:, 0] / depth / slope + width / 2
    row = optical[:, 1] / depth / slope + height / 2
    return np.column_stack([column, row, optical[:, 2]])
