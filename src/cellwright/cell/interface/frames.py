"""The frame tree of the kit-building cell, as published on /tf and /tf_static."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from cellwright.cell.devices.logical_camera import TfFrame
from cellwright.cell.devices.scene import body_poses
from cellwright.cell.model.link_frames import frames_by_link
from cellwright.config.layout.arm_models import chain_in_engine, links_by_frame
from cellwright.config.layout.arms import Arm
from cellwright.config.robot.cameras import picture_cameras
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import WRIST_3_T_TOOL
from cellwright.engine.simulation import Simulation
from cellwright.rendering.camera import OPTICAL
from cellwright.util.pose import Pose

LINK_FRAMES = (
    TfFrame("base_link", "base", Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, -math.pi))),
    *(TfFrame("wrist_3_link", name, pose) for name, pose in WRIST_3_T_TOOL.items()),
)
"""Frames without a body that are fixed to a link of the arm."""


def static_frames(trial: Trial) -> list[TfFrame]:
    """Return the frames that never move: of bins, load points, trays, belts, sensors, and those fixed to arm links."""
    frames = [
        TfFrame("world", f"{each.name}_frame", Pose((*each.centre, each.frame_height), each.link.quaternion))
        for each in trial.layout.bins
    ]
    frames += [TfFrame("world", f"{each.name}_load_point_frame", each.load_point) for each in trial.layout.carriers]
    frames += [TfFrame("world", f"{each.name}_frame", each.tray_frame) for each in trial.layout.trays]
    frames += [TfFrame("world", f"{each.name}_frame", each.frame) for each in trial.layout.belts]
    # The original left out sensors by their names, not by their type: a camera's frame came from the camera itself.
    frames += [
        TfFrame(
            sensor.frame if isinstance(sensor, PictureCameraConfig) else "world", f"{sensor.name}_frame", sensor.pose
        )
        for sensor in trial.sensors
        if not sensor.name.startswith("logical_camera")
    ]
    frames += [
        TfFrame(f"{camera.name}_frame", f"{camera.name}_optical_frame", OPTICAL)
        for camera in trial.sensors
        if isinstance(camera, PictureCameraConfig)
    ]
    return frames


def on_link(camera: PictureCameraConfig, trial: Trial) -> PictureCameraConfig:
    """Return a camera with the engine's name of the link that it is fixed to."""
    return replace(camera, frame=links_by_frame(trial.arms, trial.arm_models).get(camera.frame, camera.frame))


def arm_frames(simulation: Simulation, trial: Trial) -> Callable[[], list[TfFrame]]:
    """Return a function that computes the present frames of the links that the arm's joints move."""
    found = []
    for arm in trial.arms:
        driven = chain_in_engine(arm, trial.arm_models).driven
        found.append(_frames(simulation, [(joint.parent, joint.child) for joint in driven], arm.frame_of))
    return lambda: [frame for read in found for frame in read()]


def robot_frames(simulation: Simulation, trial: Trial) -> Callable[[], list[TfFrame]]:
    """Return a function that computes the present frames of all links and cameras of robots."""
    found = []
    cameras: list[TfFrame] = []
    for robot in trial.layout.robots:
        for name, camera in picture_cameras(trial.robot_models[robot.name]).items():
            frame = f"{robot.frame_prefix}{name}"
            cameras.append(TfFrame(robot.frame_of(camera.frame), f"{frame}_frame", camera.pose))
            cameras.append(TfFrame(f"{frame}_frame", f"{frame}_optical_frame", OPTICAL))
        described = trial.robot_models[robot.name].robot.prefixed(robot.prefix)
        pairs = [("world", described.root), *((joint.parent, joint.child) for joint in described.joints)]
        found.append(_frames(simulation, pairs, robot.frame_of))
    return lambda: [*(frame for read in found for frame in read()), *cameras]


def fixed_arm_frames(simulation: Simulation, trial: Trial) -> list[TfFrame]:
    """Return the frames fixed to links of the arms or to the world, with the engine's precision.

    Those of an arm that stands on a link of another one, or of a robot, are fixed to this link.
    """
    frames, read = [], partial(_frames, simulation, frame_of=frames_by_link(trial).__getitem__)
    for arm in trial.arms:
        robot = chain_in_engine(arm, trial.arm_models)
        fixed = [(joint.parent, joint.child) for joint in robot.joints if not joint.is_driven]
        below = "world" if arm.mount.on is None else arm.mount.on.body
        frames += [*read([(below, robot.root)])(), *link_frames(arm), *read(fixed)()]
    return frames


def link_frames(arm: Arm) -> list[TfFrame]:
    """Return the frames without a body that are fixed to a link of an arm."""
    prefix, found = arm.frame_prefix, LINK_FRAMES if arm.is_original else ()
    return [TfFrame(prefix + each.parent, prefix + each.child, each.pose) for each in found]


def _frames(
    simulation: Simulation, pairs: Sequence[tuple[str, str]], frame_of: Callable[[str], str]
) -> Callable[[], list[TfFrame]]:
    """Return a function that computes the present frame of the second body of each pair in that of the first."""
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    shown = {name: name if name == "world" else frame_of(name) for name in names}
    bodies = np.array([simulation.model.body(name).id for name in names], dtype=np.intp)

    def read() -> list[TfFrame]:
        simulation.refresh()
        poses = dict(zip(names, body_poses(simulation.data, bodies), strict=True))
        return [TfFrame(shown[parent], shown[child], poses[parent].relative(poses[child])) for parent, child in pairs]

    return read
