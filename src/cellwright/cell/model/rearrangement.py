"""Rearrangement: another variation of a trial, or another posture of its arm, in a model that was built already.

Building a model takes most of the time of building a cell. A variation changes few of its arrays, so they are written
in place. The result is the model that `build_world` would build, number for number: a test compares all arrays.
"""

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.model.arm import CUP_GEOM, check_joints
from cellwright.cell.model.build import World, WorldPart, first_pose
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose

_SLIDING = 0
"""Column of dry friction in the engine's coefficients; the others are the same in all trials."""


def rearrange(world: World, trial: Trial) -> World:
    """Write the places, the friction and the posture of another variation of the same trial into a world's model.

    The trials differ in nothing else: the same parts in the same order, sensors and settings.

    Args:
        world: the world; its model is changed, and it is of no use afterwards.
        trial: the trial for the next run.

    Returns:
        The world of the trial, with the same model, ids and addresses.

    Raises:
        UnknownNameError: an arm joint that does not exist.
    """
    if trial.arms:
        check_joints(trial.joints, *trial.initial_joint_states)
    model = world.model
    placed = [*trial.bin_parts, *trial.extra_parts]
    count = len(placed)
    frames = trial.layout.reference_frames
    starts = [frames[entry.frame] @ entry.pose for entry in placed]
    parts = [_move(model, part, start) for part, start in zip(world.parts[:count], starts, strict=True)]
    has_trial_friction = np.ones(model.ngeom, dtype=np.bool_)
    for arm in trial.arms:
        if arm.tool.kind == "vacuum":
            has_trial_friction[model.geom(arm.prefix + CUP_GEOM).id] = False  # the cup has its own
        if arm.tool.kind == "parallel":
            has_trial_friction[[model.geom(name).id for name in arm.gripper_names.pads]] = False
    model.geom_friction[has_trial_friction, _SLIDING] = trial.circumstances.friction
    # inertias in the first pose, as when it was compiled
    mujoco.mj_setConst(model, mujoco.MjData(model))
    qpos, ctrl = first_pose(model, trial)
    return replace(world, parts=(*parts, *world.parts[count:]), initial_qpos=qpos, initial_ctrl=ctrl)


def _move(model: Any, part: WorldPart, start: Pose) -> WorldPart:
    model.body_pos[part.body] = start.position
    quaternion = np.array(start.quaternion)
    mujoco.mju_normalize4(quaternion)
    model.body_quat[part.body] = quaternion
    place = np.concatenate([start.position, quaternion])
    for first in (model.qpos0, model.qpos_spring):
        first[part.qpos : part.qpos + 7] = place
    return replace(part, start=start)
