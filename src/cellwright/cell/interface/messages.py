"""Devices' readings as messages of the 2017 contract."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cellwright.cell.devices.sensors import laser_profiler, proximity
from cellwright.cell.devices.sensors.break_beam import BEAM_LENGTH, BEAM_START, BeamReading
from cellwright.cell.devices.sensors.laser_profiler import ProfileReading
from cellwright.cell.devices.sensors.logical_camera import CameraReading, Frame
from cellwright.cell.devices.sensors.proximity import ProximityReading
from cellwright.cell.devices.trajectory.controller import Following
from cellwright.cell.kitting.tray import TrayObject
from cellwright.config.trial.trial import Order
from cellwright.middleware.messages.build import (
    header,
    pose_message,
    single,
    singles,
    trajectory_point,
    transform_stamped,
)
from cellwright.middleware.messages.control_msgs import JointTrajectoryControllerState
from cellwright.middleware.messages.osrf_gear import (
    DetectedObject,
    Kit,
    KitObject,
    LogicalCameraImage,
    Model,
    Proximity,
    TrayContents,
)
from cellwright.middleware.messages.osrf_gear import Order as OrderMessage
from cellwright.middleware.messages.standard import LaserScan, Range, TFMessage

ULTRASOUND = 0
"""sensor_msgs/Range.radiation_type of the proximity sensor."""

FIELD_OF_VIEW = 0.125
"""sensor_msgs/Range.field_of_view of the proximity sensor [rad]."""

# What is the same in each message of a sensor, in the order of its fields: dozens come in a second.
_BEAM_RANGES = single(BEAM_START), single(BEAM_START + BEAM_LENGTH)
_CONE = single(FIELD_OF_VIEW), single(proximity.MIN_RANGE), single(proximity.MAX_RANGE)
_FAN = (
    single(-laser_profiler.HALF_ANGLE),
    single(laser_profiler.HALF_ANGLE),
    single(2 * laser_profiler.HALF_ANGLE / (laser_profiler.RAY_COUNT - 1)),
    0.0,  # between two rays [s]
    0.0,  # between two scans [s]
    single(laser_profiler.MIN_RANGE),
    single(laser_profiler.MAX_RANGE),
)
_INTENSITIES = singles(np.zeros(laser_profiler.RAY_COUNT))


def order_message(order: Order) -> OrderMessage:
    """An order as it is announced."""
    return OrderMessage(
        order.order_id,
        [
            Kit(kit.kit_type, [KitObject(each.type, pose_message(each.pose)) for each in kit.objects])
            for kit in order.kits
        ],
    )


def tray_message(tray_id: str, objects: Sequence[TrayObject]) -> TrayContents:
    """What a tray holds."""
    return TrayContents(
        tray_id, [DetectedObject(each.type, each.is_faulty, pose_message(each.tray_T_object)) for each in objects]
    )


def beam_message(reading: BeamReading, frame: str) -> Proximity:
    """A break beam's reading. The ranges are those of the ray, seen from the sensor's pose."""
    return Proximity(header(frame, reading.time_ns), reading.detected, *_BEAM_RANGES)


def range_message(reading: ProximityReading, frame: str) -> Range:
    """A proximity sensor's reading."""
    return Range(
        header(frame, reading.time_ns),
        ULTRASOUND,
        *_CONE,
        single(reading.range),
        0.0,
    )


def scan_message(reading: ProfileReading, frame: str) -> LaserScan:
    """A laser profiler's reading."""
    return LaserScan(header(frame, reading.time_ns), *_FAN, singles(reading.ranges), _INTENSITIES)


def image_message(reading: CameraReading) -> LogicalCameraImage:
    """A logical camera's picture: model poses in the camera frame, the camera's own in the world frame."""
    return LogicalCameraImage(
        [Model(each.type, pose_message(each.camera_T_model)) for each in reading.detections],
        pose_message(reading.world_T_camera),
    )


def frames_message(frames: Sequence[Frame], time: int) -> TFMessage:
    """Coordinate frames at a time [ns]."""
    return TFMessage([transform_stamped(each.parent, each.child, each.pose, time) for each in frames])


def controller_state_message(names: Sequence[str], following: Following, time: int) -> JointTrajectoryControllerState:
    """What the arm's controller wants and what the joints do."""
    desired = following.desired
    return JointTrajectoryControllerState(
        header("", time),
        list(names),
        trajectory_point(desired.positions, desired.velocities, desired.accelerations),
        trajectory_point(following.actual_positions, following.actual_velocities),
        trajectory_point(following.error_positions, following.error_velocities),
    )
