"""Occurrence of rows: in which cells they are, for what each, and how they differ in competition mode."""

from enum import Enum

from cellwright.config.trial.trial import CameraType, SensorType
from cellwright.middleware.interface.table import Where

AGVS = ("1", "2")

WITH_ARM = Where.when("with an arm", lambda trial: trial.has_arm)
WITH_AGVS = Where.when("with AGVs", lambda trial: trial.options.insert_agvs)
EACH_AGV = Where("for each AGV", lambda trial: AGVS if trial.options.insert_agvs else ())
WITH_BELT_PARTS = Where.when("with belt parts", lambda trial: trial.belt_parts)
WITH_CAMERAS = Where.when(
    "with AGVs or logical cameras",
    lambda trial: trial.options.insert_agvs or any(sensor.type == "logical_camera" for sensor in trial.sensors),
)


class CompetitionMode(Enum):
    """Treatment of a row in competition mode; all others are the same."""

    REFUSES = "answers success = false"
    SILENCED = "silent"
    """Nothing is published. Subscribing has no price, unlike in the original, where it spoilt the score."""
    ABSENT = "absent"


def _each_sensor(text: str, *types: SensorType | CameraType) -> Where:
    """Return the occurrence of a row that exists for each sensor of some types."""
    return Where(text, lambda trial: [sensor.name for sensor in trial.sensors if sensor.type in types])


EACH_BREAK_BEAM = _each_sensor("for each break beam", "break_beam")
EACH_PROXIMITY_SENSOR = _each_sensor("for each proximity sensor", "proximity_sensor")
EACH_LASER_PROFILER = _each_sensor("for each laser profiler", "laser_profiler")
EACH_LOGICAL_CAMERA = _each_sensor("for each logical camera", "logical_camera")
EACH_COLOUR_CAMERA = _each_sensor("for each rgb_camera and rgbd_camera", "rgb_camera", "rgbd_camera")
EACH_DEPTH_CAMERA = _each_sensor("for each depth_camera and rgbd_camera", "depth_camera", "rgbd_camera")
EACH_CLOUD_CAMERA = _each_sensor("for each depth_camera", "depth_camera")
