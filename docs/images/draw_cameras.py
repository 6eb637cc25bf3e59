"""Draws docs/images/cameras.png and camera-robot.png: what cameras see of the lesson's cell, and of QingLong itself.

To be run from the project's root.
"""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.clients.agents.lesson import LessonAgent
from cellwright.config.robot.config import Camera as RobotCamera
from cellwright.config.robot.robots import load_robot
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.rendering.camera import OPTICAL
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.rendering.picture import encode_png
from cellwright.robot.node import RobotNode
from cellwright.running.run import RunOptions, run_cell

OWN = """
cellwright:
  sensors:
    over_bin7:
      type: rgbd_camera
      pose: {xyz: [-0.3, 0.23, 1.7], rpy: [0, pi/2, 0]}
    slanted:
      type: depth_camera
      pose: {xyz: [-1.0, 0.23, 1.3], rpy: [0, 0.75, 0]}
    wrist:
      type: rgb_camera
      frame: vacuum_gripper_link
      pose: {xyz: [0.08, 0, 0], rpy: [0, pi/2, 0]}
      fov: 1.3
"""
NEAR, FAR = 0.45, 1.4  # [m], white and black
BEHIND = (24, 34, 54)


def grey(depth: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Depth as brightness: the nearer the brighter, and dark blue where nothing was measured."""
    share = np.clip((FAR - depth) / (FAR - NEAR), 0.0, 1.0)
    picture = np.repeat(np.nan_to_num(share * 255)[..., None], 3, axis=2).astype(np.uint8)
    picture[~np.isfinite(depth)] = BEHIND
    return picture


def from_above(camera: PictureCamera, depth: NDArray[np.float32], size: int = 480) -> NDArray[np.uint8]:
    """The points of a depth picture as seen from above: where they are, the higher the brighter."""
    points = camera.pinhole.points(depth)[np.isfinite(depth)]
    world_T_optical = camera.world_T_camera @ OPTICAL
    turned = np.array([world_T_optical.transform(tuple(point)) for point in points.astype(float).tolist()])
    rows = ((0.15 - turned[:, 0]) / 0.9 * size).astype(int)
    columns = ((0.83 - turned[:, 1]) / 1.2 * 4 / 3 * size * 0.75).astype(int)
    picture = np.full((size, 640, 3), BEHIND, np.uint8)
    within = (rows >= 0) & (rows < size) & (columns >= 0) & (columns < 640)
    order = np.argsort(turned[within, 2])
    shade = np.clip((turned[within, 2] - 0.7) / 0.07, 0.05, 1.0)[order]
    picture[rows[within][order], columns[within][order]] = (shade[:, None] * (255, 225, 170)).astype(np.uint8)
    return picture


def draw(cell: Cell) -> None:
    """Have each camera take a picture."""
    cameras = {name: each for name, each in cell.sensors.items() if isinstance(each, PictureCamera)}
    taken = {name: camera.read() for name, camera in cameras.items()}
    depth = taken["slanted"].depth
    assert depth is not None
    over, wrist = taken["over_bin7"].colour, taken["wrist"].colour
    assert over is not None
    assert wrist is not None
    rows = [[over, wrist], [grey(depth), from_above(cameras["slanted"], depth)]]
    all_four = np.vstack([np.hstack([halved(picture) for picture in row]) for row in rows])
    Path("docs/images/cameras.png").write_bytes(encode_png(all_four))


def draw_robot() -> None:
    """Have a camera on QingLong's head look at its hands."""
    values = {"pos_offset": [0.15, 0.0, 0.05], "target_offset": [0.6, 0.0, -0.5]}
    config = replace(load_robot("qinglong", warn=print), cameras=(RobotCamera("first_person", values),))
    node = RobotNode(config)
    node.simulation.step_until(1_000_000_000)
    picture = node.cameras["first_person"].read().colour
    assert picture is not None
    Path("docs/images/camera-robot.png").write_bytes(encode_png(halved(picture)))
    node.close()


def halved(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture of half the width and height."""
    height, width, _ = picture.shape
    small: NDArray[np.uint8] = picture.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3)).astype(np.uint8)
    return small


if __name__ == "__main__":
    own = Path("own.yaml")
    own.write_text(OWN)
    try:
        lesson = Cell(load_trial([find_trial("lesson"), own]).trial)
    finally:
        own.unlink()
    run_cell(lesson, LessonAgent(), RunOptions(until=3.6, at=[(Fraction("3.4"), draw)]))
    draw_robot()
