"""Layouts that are not 2017's, for the checks."""

from dataclasses import replace

from cellwright.config.layout.layout import Bin, Layout, Tray
from cellwright.config.layout.surroundings import Block, Structure
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose
from tests.support.places import LAYOUT


def bin_at(name: str, x: float, y: float, yaw: float = 0.0, size: tuple[float, float] = (0.6, 0.6)) -> Bin:
    pose = Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw))
    return Bin(name, pose, pose, size)


def post_at(name: str, x: float, y: float) -> Structure:
    return Structure(name, Pose((x, y, 0.0)), (Block(Pose((0.0, 0.0, 1.0)), (0.1, 0.1, 2.0)),))


def camera_over(name: str, x: float, y: float, z: float) -> SensorConfig:
    return SensorConfig(name, "logical_camera", Pose.from_rpy((x, y, z), (0.0, 1.5708, 0.0)))


def trial_with(layout: Layout, *sensors: SensorConfig, has_arm: bool = True) -> Trial:
    return Trial("odd", layout=layout, sensors=sensors, has_arm=has_arm)


EMPTY = replace(LAYOUT, bins=(), belts=(), carriers=(), structure=())
SMALL = replace(
    EMPTY,
    bins=(bin_at("left", -0.4, 0.5), bin_at("right", -0.4, -0.5, yaw=0.3)),
    trays=(Tray(1, "table", Pose((1.0, 0.0, 0.0))),),
)
"""Two bins and a fixed tray at 2017's rail, all within reach."""
