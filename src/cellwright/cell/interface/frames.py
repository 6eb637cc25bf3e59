"""The frame tree of the kit-building cell, as published on /tf and /tf_static."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from cellwright.cell.devices.logical_camera import TfFrame
from cellwright.cell.model.link_frames import frames_by_link
from cellwright.config.layout.arm_models import chain_in_engine, links_by_frame
from cellwright.config.layout.arms import Arm
from cellwright.config.robot.cameras import picture_cameras
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import WRIST_3_T_TOOL
from cellwright.engine.simulation import Simulation
from cellwright.middleware.messages.conversions import stamp
from cellwright.middleware.messages.standard import Header, Quaternion, Transform, TransformStamped, Vector3
from cellwright.rendering.camera import OPTICAL
from cellwright.util import pose as poses
from cellwright.util.pose import Pose, relative

LINK_FRAMES = (
    TfFrame("base_link", "base", Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, -math.pi))),
    *(TfFrame("wrist_3_link", name, pose) for name, pose in WRIST_3_T_TOOL.items()),
)
"""Frames without a body that are fixed to a link of the arm."""

Link: TypeAlias = tuple[str, str, poses.Vector3, poses.Quaternion]
"""Frame as bare numbers: that of its parent, its own, position [m] and quaternion (w, x, y, z) in its parent."""


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


def arm_frames(simulation: Simulation, trial: Trial) -> Callable[[], list[Link]]:
    """Return a function that gives the present frames of the links that the arm's joints move.

    They are bare numbers: /tf is the most expensive topic of a recording.
    """
    found = []
    for arm in trial.arms:
        driven = chain_in_engine(arm, trial.arm_models).driven
        found.append(_links(simulation, [(joint.parent, joint.child) for joint in driven], arm.frame_of))
    return lambda: [link for read in found for link in read()]


def robot_frames(simulation: Simulation, trial: Trial) -> Callable[[], list[Link]]:
    """Return a function that gives the present frames of all links and cameras of robots."""
    found = []
    cameras: list[Link] = []
    for robot in trial.layout.robots:
        for name, camera in picture_cameras(trial.robot_models[robot.name]).items():
            frame, pose = f"{robot.frame_prefix}{name}", camera.pose
            cameras.append((robot.frame_of(camera.frame), f"{frame}_frame", pose.position, pose.quaternion))
            cameras.append((f"{frame}_frame", f"{frame}_optical_frame", OPTICAL.position, OPTICAL.quaternion))
        described = trial.robot_models[robot.name].robot.prefixed(robot.prefix)
        pairs = [("world", described.root), *((joint.parent, joint.child) for joint in described.joints)]
        found.append(_links(simulation, pairs, robot.frame_of))
    return lambda: [*(link for read in found for link in read()), *cameras]


def fixed_arm_frames(simulation: Simulation, trial: Trial) -> list[TfFrame]:
    """Return the frames fixed to links of the arms or to the world, with the engine's precision.

    Those of an arm that stands on a link of another one, or of a robot, are fixed to this link.
    """
    frames, frame_of = [], frames_by_link(trial).__getitem__
    for arm in trial.arms:
        robot = chain_in_engine(arm, trial.arm_models)
        fixed = [(joint.parent, joint.child) for joint in robot.joints if not joint.is_driven]
        below = "world" if arm.mount.on is None else arm.mount.on.body
        root, links = (_links(simulation, pairs, frame_of)() for pairs in ([(below, robot.root)], fixed))
        frames += [*map(_frame, root), *link_frames(arm), *map(_frame, links)]
    return frames


def link_frames(arm: Arm) -> list[TfFrame]:
    """Return the frames without a body that are fixed to a link of an arm."""
    prefix, found = arm.frame_prefix, LINK_FRAMES if arm.is_original else ()
    return [TfFrame(prefix + each.parent, prefix + each.child, each.pose) for each in found]


def transforms(links: Sequence[Link], time: int) -> list[TransformStamped]:
    """Return links as messages at a time [ns]."""
    at = stamp(time)
    return [
        TransformStamped(Header(at, parent), child, Transform(Vector3(*position), Quaternion(x, y, z, w)))
        for parent, child, position, (w, x, y, z) in links
    ]


def _links(
    simulation: Simulation, pairs: Sequence[tuple[str, str]], frame_of: Callable[[str], str]
) -> Callable[[], list[Link]]:
    """Return a function that computes the present frame of the second body of each pair in that of the first."""
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    shown = {name: name if name == "world" else frame_of(name) for name in names}
    places = {name: place for place, name in enumerate(names)}
    links = [(places[parent], places[child], shown[parent], shown[child]) for parent, child in pairs]
    bodies = np.array([simulation.model.body(name).id for name in names], dtype=np.intp)

    def read() -> list[Link]:
        simulation.refresh()
        data = simulation.data
        at, turns = data.xpos.take(bodies, 0).tolist(), data.xquat.take(bodies, 0).tolist()
        return [
            (parent, child, *relative(at[one], turns[one], at[other], turns[other]))
            for one, other, parent, child in links
        ]

    return read


def _frame(link: Link) -> TfFrame:
    parent, child, position, quaternion = link
    return TfFrame(parent, child, Pose(position, quaternion))
