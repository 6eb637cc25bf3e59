"""The frame tree of the kit-building cell, as published on /tf and /tf_static."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from cellwright.cell.devices.logical_camera import TfFrame
from cellwright.cell.devices.scene import body_poses
from cellwright.config.trial.trial import PictureCameraConfig, Trial
from cellwright.config.ur10 import GRIPPER, UR10, WRIST_3_T_TOOL
from cellwright.engine.simulation import Simulation
from cellwright.rendering.camera import OPTICAL
from cellwright.util.pose import Pose

ARM_CHAIN = (UR10.root, *(joint.child for joint in UR10.driven))
"""The rail and the links that the joints move, each in the frame of the previous one."""

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


def arm_chain(simulation: Simulation, links: Sequence[str] = ARM_CHAIN) -> Callable[[], list[TfFrame]]:
    """Return a function that computes the present frames of links, each in the frame of the previous one."""
    bodies = np.array([simulation.model.body(name).id for name in links])

    def read() -> list[TfFrame]:
        simulation.refresh()
        places = pairwise(zip(links, body_poses(simulation.data, bodies), strict=True))
        return [TfFrame(parent, child, before.relative(pose)) for (parent, before), (child, pose) in places]

    return read


def fixed_arm_frames(simulation: Simulation) -> list[TfFrame]:
    """Return the frames fixed to a link of the arm or to the world, with the engine's precision."""
    rail, gripper = ("world", ARM_CHAIN[0]), ("wrist_3_link", GRIPPER)
    return [*arm_chain(simulation, rail)(), *LINK_FRAMES, *arm_chain(simulation, gripper)()]
