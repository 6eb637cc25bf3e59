"""Accelerations that a robot's drives can bear: proposals for `max_acceleration` of a configuration.

The drive of a joint that changes its speed works against the inertia of all that hangs on it, and the other drives have
to hold against it. Where one of them reaches its limit of effort, its joint overshoots or strays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from cellwright.config.robot.arrangement import groups
from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.rig import Rig
from cellwright.robot.servos import Array, fastest

SHARE = 0.7
"""Share of the efforts that inertia may take; the rest is for the forces that come with speed."""
RAMP = 0.05
"""Least time in which a joint gains its full speed [s]: shorter than a servo's own lag, it would change nothing."""
POSTURES = 30
"""Number of postures, besides the one that the robot is put up in, that are looked at; the same in each check."""

_WIDEST = math.pi  # [rad; m] from 0: so far postures of joints with wide ranges are drawn
_LEAST = 1e-3  # [rad/s^2; m/s^2]; what is proposed for a joint that cannot move is above 0
_DIGITS = 2  # of a figure that is proposed


def bearable_accelerations(rig: Rig, config: RobotConfig) -> dict[str, float]:
    """Accelerations of the driven joints at which no drive reaches its limit of effort [rad/s^2; m/s^2], by joint.

    What one joint may do alone is effort over inertia: of its own drive, and of all that have to hold against it; the
    least of some postures. All are then lowered until each drive bears all joints at once, whose efforts add up as
    independent ones do, by their squares: they seldom all pull the same way.
    """
    inertias = np.abs(_inertias(rig, config))
    limits = [joint.limits.effort for joint in config.robot.driven]
    efforts = SHARE * np.array([limit if limit > 0.0 else math.inf for limit in limits])
    with np.errstate(divide="ignore"):
        alone = (efforts[:, None] / inertias).min(axis=(0, 1))
    alone = np.minimum(alone, np.array([fastest(joint) for joint in config.robot.driven]) / RAMP)
    loads = (np.sqrt(((inertias * alone) ** 2).sum(axis=2)) / efforts).max(axis=0)
    shared = np.where(inertias.max(axis=0) > 0.0, np.maximum(loads, 1.0)[:, None], 1.0).max(axis=0)
    found: Array = alone / shared
    return {joint.name: value for joint, value in zip(config.robot.driven, found.tolist(), strict=True)}


def _inertias(rig: Rig, config: RobotConfig) -> Array:
    """The inertia that each drive feels of each joint's acceleration, in some postures (postures, drives, joints)."""
    rig.begin()
    model, first = rig.node.simulation.model, rig.node.simulation.data.qpos.copy()
    joints = config.robot.driven
    places = np.array([model.joint(joint.name).qposadr[0] for joint in joints])
    dofs = np.array([model.joint(joint.name).dofadr[0] for joint in joints])
    lower = np.array([max(joint.limits.lower, -_WIDEST) for joint in joints])
    upper = np.array([min(joint.limits.upper, _WIDEST) for joint in joints])
    chance, data = np.random.default_rng(0), mujoco.MjData(model)
    whole = np.zeros((model.nv, model.nv))
    found = np.empty((POSTURES + 1, len(joints), len(joints)))
    for number in range(POSTURES + 1):
        data.qpos[:] = first
        if number:
            data.qpos[places] = lower + chance.random(len(joints)) * (upper - lower)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, whole)
        found[number] = whole[np.ix_(dofs, dofs)]
    return found


def proposal(rig: Rig, config: RobotConfig, joints: Sequence[str]) -> str:
    """Entries to write for the groups of some joints, or a figure for each joint that is in no group."""
    known = bearable_accelerations(rig, config)
    entries = [
        f"{key}.max_acceleration: {_listed(config, key, members, known)}"
        for key, members, _ in groups(config)
        if set(members) & set(joints)
    ]
    grouped = {name for _, members, _ in groups(config) for name in members}
    alone = [f"{name} {_figure(known[name])}" for name in joints if name not in grouped]
    if alone:
        entries.append(f"max_acceleration of a group with {', '.join(alone)}")
    return f"drives reach their limits of effort; write in the configuration: {'; '.join(entries)}"


def _listed(config: RobotConfig, key: str, members: tuple[str, ...], known: Mapping[str, float]) -> str:
    """One figure for each place in the list of a group's joints; the head's has three."""
    figures = [_figure(known[name]) for name in members]
    if key == "head":
        figures = [figures[config.head_axes.index(axis)] if axis in config.head_axes else "1" for axis in range(3)]
    return f"[{', '.join(figures)}]"


def _figure(value: float) -> str:
    """A figure in few digits, and not above what it stands for."""
    value = max(value, _LEAST)
    scale = 10.0 ** (math.floor(math.log10(value)) - _DIGITS + 1)
    return f"{math.floor(value / scale) * scale:g}"
