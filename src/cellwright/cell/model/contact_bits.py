"""Contact bits of arms and robots in the engine: each touches the others, and not itself."""

from collections.abc import Collection, Iterator
from typing import Any

from cellwright.config.layout.arm_models import chain_in_engine
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import Touch

_FIRST = 3
"""Bit of the first of several arms and robots; the lower ones are those of `Touch`."""


def give_contact_bits(spec: Any, trial: Trial) -> None:
    """Let the arms and robots of a model specification touch each other, each with a bit of its own.

    Mounts of arms touch robots alone: carriages of arms overlap a beam that they share by design.

    Args:
        spec: model specification with the arms and robots of the trial.
        trial: the trial.
    """
    mounts = [spec.body(chain_in_engine(arm, trial.arm_models).root) for arm in trial.arms]
    bases = [spec.body(robot.base) for robot in trial.layout.robots]
    own = [1 << _FIRST + number for number in range(len(mounts) + len(bases))]
    if len(own) == 1:
        return
    owners = (*mounts, *bases)
    names = {owner.name for owner in owners}
    for body, bit in zip(owners, own, strict=True):
        for geom in _geoms_on(body, names):
            if geom.contype == Touch.ROBOT.value[0]:
                geom.contype |= bit
                geom.conaffinity |= sum(own) & ~bit
    for mount in mounts:
        for geom in mount.geoms:
            if geom.contype:
                geom.conaffinity |= sum(own[len(mounts) :])


def _geoms_on(body: Any, others: Collection[str]) -> Iterator[Any]:
    """Yield the geoms of all bodies that a body carries, without those of arms that stand on it."""
    for each in body.bodies:
        if each.name not in others:
            yield from each.geoms
            yield from _geoms_on(each, others)
