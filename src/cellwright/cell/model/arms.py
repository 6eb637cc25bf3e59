"""Arms of a cell in the engine."""

from typing import Any

from cellwright.cell.model.arm import add_arm, check_joints
from cellwright.cell.model.own_arm import add_own_arm
from cellwright.config.layout.arm_models import joints_of
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import Visuals


def add_arms(spec: Any, visuals: Visuals, trial: Trial, contact_time: float) -> None:
    """Add the arms of a trial to a model specification, before everything else.

    Args:
        spec: model specification.
        visuals: receives what is only seen of them.
        trial: the trial.
        contact_time: time constant [s] of the cups' contacts.

    Raises:
        UnknownNameError: a setting names a joint that no arm has.
        ModelFileError: a mesh cannot be used.
    """
    arms, settings = trial.arms, trial.settings.arm
    if arms:
        names = {name for arm in arms for name in joints_of(arm, trial.arm_models)}
        check_joints(names, *settings.gains, *settings.dry_friction)
        check_joints(trial.joints, *trial.initial_joint_states)
    for arm in arms:
        if arm.is_original:
            add_arm(spec, visuals, settings, contact_time, arm)
        else:
            add_own_arm(spec, visuals, arm, trial.arm_models[arm.name], contact_time)
