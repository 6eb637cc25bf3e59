"""Arms of a cell in the engine, each with its own bits, by which arms touch each other and not themselves."""

from collections.abc import Iterator
from typing import Any

from cellwright.cell.model.arm import add_arm, check_joints
from cellwright.cell.model.own_arm import add_own_arm
from cellwright.config.layout.arm_models import joints_of
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import Touch, Visuals

_FIRST_BIT = 3
"""Bit of the first of several arms; the lower ones are those of `Touch`."""


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
    every = sum(1 << _FIRST_BIT + number for number in range(len(arms)))
    for number, arm in enumerate(arms):
        if arm.is_original:
            root = add_arm(spec, visuals, settings, contact_time, arm)
        else:
            root = add_own_arm(spec, visuals, arm, trial.arm_models[arm.name], contact_time)
        if len(arms) > 1:
            own = 1 << _FIRST_BIT + number
            # but for the mount: carriages of arms overlap a beam that they share by design
            for geom in _geoms_on(root):
                if geom.contype == Touch.ROBOT.value[0]:
                    geom.contype |= own
                    geom.conaffinity |= every & ~own


def _geoms_on(body: Any) -> Iterator[Any]:
    """Yield the geoms of all bodies that a body carries."""
    for each in body.bodies:
        yield from each.geoms
        yield from _geoms_on(each)
