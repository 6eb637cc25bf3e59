"""Occurrence of rows: in which cells they are, for what each, and how they differ in competition mode."""

from enum import Enum

from cellwright.config.sensors import CameraType, SensorType
from cellwright.config.trial.trial import Trial
from cellwright.middleware.interface.table import Where

WITH_ARM = Where.when("with an arm", lambda trial: trial.has_arm)
WITH_ROBOTS = Where.when("with robots in the cell", lambda trial: trial.layout.robots)
WITH_ARM_OR_ROBOT = Where.when("with an arm or a robot in the cell", lambda trial: trial.has_arm or trial.layout.robots)
EACH_ARM = Where("with an arm", lambda trial: [each.namespace or None for each in trial.arms])
# an arm of one's own may have no tool; the words are those of the arm of 2017
EACH_GRIPPER = Where(
    "with an arm", lambda trial: [each.namespace or None for each in trial.arms if each.tool.kind != "none"]
)
EACH_FINGERS = Where(
    "with a parallel gripper",
    lambda trial: [each.namespace or None for each in trial.arms if each.tool.kind == "parallel"],
)
WITH_NAMESPACES = Where.when("with several arms", lambda trial: any(each.namespace for each in trial.arms))
WITH_TRAYS = Where.when("with AGVs or fixed trays", lambda trial: trial.stations)
EACH_AGV = Where("for each AGV", lambda trial: [each.name for each in trial.carriers])
EACH_QUALITY_SENSOR = Where("for each AGV", lambda trial: [str(each.number) for each in trial.carriers])
EACH_TRAY = Where("for each AGV and fixed tray", lambda trial: [str(each.number) for each in trial.stations])
EACH_FIXED_TRAY = Where("for each fixed tray", lambda trial: [each.name for each in trial.layout.trays])
WITH_BELT = Where.when("with one belt", lambda trial: len(trial.layout.belts) == 1)
EACH_BELT = Where("for each of several belts", lambda trial: _several_belts(trial))
WITH_BELT_PARTS = Where.when("with belt parts on one belt", lambda trial: WITH_BELT.subjects(trial) and _flows(trial))
EACH_FLOW = Where(
    "for each of several belts with parts",
    lambda trial: [name for name in _several_belts(trial) if name in _flows(trial)],
)
WITH_CAMERAS = Where.when(
    "with AGVs or logical cameras",
    lambda trial: trial.carriers or any(sensor.type == "logical_camera" for sensor in trial.sensors),
)
EACH_BREAK_BEAM = Where("for each break beam", lambda trial: _sensors(trial, "break_beam"))
EACH_PROXIMITY_SENSOR = Where("for each proximity sensor", lambda trial: _sensors(trial, "proximity_sensor"))
EACH_LASER_PROFILER = Where("for each laser profiler", lambda trial: _sensors(trial, "laser_profiler"))
EACH_LOGICAL_CAMERA = Where("for each logical camera", lambda trial: _sensors(trial, "logical_camera"))
EACH_COLOUR_CAMERA = Where(
    "for each rgb_camera and rgbd_camera", lambda trial: _sensors(trial, "rgb_camera", "rgbd_camera")
)
EACH_DEPTH_CAMERA = Where(
    "for each depth_camera and rgbd_camera", lambda trial: _sensors(trial, "depth_camera", "rgbd_camera")
)
EACH_CLOUD_CAMERA = Where("for each depth_camera", lambda trial: _sensors(trial, "depth_camera"))


class CompetitionMode(Enum):
    """Treatment of a row in competition mode; all others are the same."""

    REFUSES = "answers success = false"
    SILENCED = "silent"
    """Nothing is published. Subscribing has no price, unlike in the original, where it spoilt the score."""
    ABSENT = "absent"


def _several_belts(trial: Trial) -> list[str]:
    """Return the names of the belts if there are several: topics of a single one do not name it."""
    names = [each.name for each in trial.layout.belts]
    return names if len(names) > 1 else []


def _flows(trial: Trial) -> set[str]:
    """Return the names of the belts that parts come on."""
    return {part.belt for part in trial.belt_parts}


def _sensors(trial: Trial, *types: SensorType | CameraType) -> list[str]:
    """Return the names of the sensors of some types."""
    return [sensor.name for sensor in trial.sensors if sensor.type in types]
