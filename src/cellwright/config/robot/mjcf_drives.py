"""Drives of a robot's MJCF file: gains and forces of actuators, friction of joints, and joints that follow others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from cellwright.config.parsing.tree import Problems
from cellwright.config.robot.mjcf_file import CompiledMjcf
from cellwright.config.robot.model import Mimic

_UNLIMITED = (-math.inf, math.inf)
Names = Mapping[int, str]
"""Names of joints, by their numbers in the engine's model."""


@dataclass(frozen=True, slots=True)
class PositionDrive:
    """Position controller of a joint: `kp * error - kv * velocity`, within a range of forces.

    Attributes:
        kp: stiffness [N m/rad; N/m].
        kv: damping [N m s/rad; N s/m].
        force_range: smallest and largest force [N m; N].
    """

    kp: float
    kv: float = 0.0
    force_range: tuple[float, float] = _UNLIMITED


@dataclass(frozen=True, slots=True)
class JointDynamics:
    """Inertia and friction in the drive of a joint.

    Attributes:
        armature: inertia of the motor as the joint feels it [kg m^2; kg].
        damping: viscous friction [N m s/rad; N s/m].
        friction: dry friction [N m; N].
    """

    armature: float = 0.0
    damping: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True)
class Actuation:
    """Drives of a robot.

    Attributes:
        drives: position controllers, by joint.
        efforts: largest force of each joint [N m; N], where the file limits it.
    """

    drives: Mapping[str, PositionDrive]
    efforts: Mapping[str, float]


def read_actuation(mjcf: CompiledMjcf, names: Names, mimics: Mapping[str, Mimic], problems: Problems) -> Actuation:
    """Return the drives of joints; several actuators of one joint add up.

    An actuator of a fixed tendon drives the joint that leads all joints of the tendon. Other actuators are left out.
    """
    _check_tendons(mjcf, problems)
    model = mjcf.model
    found: dict[str, PositionDrive] = {}
    for actuator in range(model.nu):
        joint, gear = _driven(mjcf, actuator, names, mimics)
        element = mjcf.element("actuator", actuator)
        bias = mjcf.kind("mjtBias", model.actuator_biastype[actuator])
        if joint is None or mjcf.kind("mjtGain", model.actuator_gaintype[actuator]) != "fixed":
            reason = "drives no single joint" if joint is None else "is no motor and no position controller"
            problems.warn(element, f"the actuator {reason}, and is left out")
        elif bias not in ("none", "affine"):
            problems.warn(element, f"an actuator with a bias of type {bias} is left out")
        else:
            _, kp, kv = (0.0 - float(each) for each in model.actuator_biasprm[actuator][:3])
            lower, upper = sorted(gear * force for force in _force_range(mjcf, actuator, bias))
            known = found.get(joint, PositionDrive(0.0, 0.0, (0.0, 0.0)))
            forces = (known.force_range[0] + lower, known.force_range[1] + upper)
            found[joint] = PositionDrive(known.kp + gear**2 * kp, known.kv + gear**2 * kv, forces)
    efforts = {joint: max(map(abs, drive.force_range)) for joint, drive in found.items()}
    for number, name in names.items():
        if model.jnt_actfrclimited[number]:
            effort = max(abs(float(force)) for force in model.jnt_actfrcrange[number])
            efforts[name] = min(effort, efforts.get(name, math.inf))
    return Actuation({joint: drive for joint, drive in found.items() if drive.kp > 0}, efforts)


def _force_range(mjcf: CompiledMjcf, actuator: int, bias: str) -> tuple[float, float]:
    """Return the range of an actuator's force: its own, or that of a motor's command."""
    model = mjcf.model
    if model.actuator_forcelimited[actuator]:
        lower, upper = map(float, model.actuator_forcerange[actuator])
    elif bias == "none" and model.actuator_ctrllimited[actuator] and model.actuator_actadr[actuator] < 0:
        gain = float(model.actuator_gainprm[actuator][0])
        lower, upper = sorted(gain * float(command) for command in model.actuator_ctrlrange[actuator])
    else:
        lower, upper = _UNLIMITED
    return lower, upper


def _driven(mjcf: CompiledMjcf, actuator: int, names: Names, mimics: Mapping[str, Mimic]) -> tuple[str | None, float]:
    """Return the joint that an actuator drives, and the ratio of the joint's force to the actuator's.

    By the work that the forces do: where joints follow a leader, their forces times their ratios act on the leader.
    """
    model = mjcf.model
    number = int(model.actuator_trnid[actuator][0])
    kind = mjcf.kind("mjtTrn", model.actuator_trntype[actuator])
    shares: list[tuple[int, float]] = []
    if kind in ("joint", "jointinparent"):
        shares = [(number, 1.0)]
    elif kind == "tendon":
        first, count = int(model.tendon_adr[number]), int(model.tendon_num[number])
        shares = [(int(model.wrap_objid[wrap]), float(model.wrap_prm[wrap])) for wrap in range(first, first + count)]
    gears: dict[str, float] = {}
    for joint, share in shares:
        name = names.get(joint)
        if name is None or mjcf.kind("mjtJoint", model.jnt_type[joint]) not in ("hinge", "slide"):
            return None, 0.0
        mimic = mimics.get(name, Mimic(name))
        gears[mimic.joint] = gears.get(mimic.joint, 0.0) + share * mimic.multiplier
    if len(gears) != 1:
        return None, 0.0
    ((joint_name, ratio),) = gears.items()
    return joint_name, ratio * float(model.actuator_gear[actuator][0])


def _check_tendons(mjcf: CompiledMjcf, problems: Problems) -> None:
    """Refuse tendons that act on joints by themselves; a fixed one may pass the force of an actuator on."""
    model = mjcf.model
    for tendon in range(model.ntendon):
        wraps = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
        is_fixed = all(mjcf.kind("mjtWrap", model.wrap_type[wrap]) == "joint" for wrap in wraps)
        forces = (model.tendon_stiffness, model.tendon_damping, model.tendon_frictionloss, model.tendon_armature)
        if not is_fixed:
            problems.error(mjcf.element("tendon", tendon), "a robot has no spatial tendons; remove it")
        elif model.tendon_limited[tendon] or any(each[tendon] for each in forces):
            message = (
                "a robot's tendon only passes force on; remove its limits, stiffness, damping, friction and armature"
            )
            problems.error(mjcf.element("tendon", tendon), message)


def read_dynamics(mjcf: CompiledMjcf, names: Names, problems: Problems) -> dict[str, JointDynamics]:
    """Return armature, damping and dry friction of joints with one degree of freedom; springs are left out."""
    model, found = mjcf.model, {}
    for joint, name in names.items():
        if mjcf.kind("mjtJoint", model.jnt_type[joint]) not in ("hinge", "slide"):
            continue
        dof = int(model.jnt_dofadr[joint])
        arrays = (model.dof_armature, model.dof_damping, model.dof_frictionloss)
        armature, damping, friction = (float(each[dof]) for each in arrays)
        if armature or damping or friction:
            found[name] = JointDynamics(armature, damping, friction)
        if model.jnt_stiffness[joint] or model.jnt_stiffnesspoly[joint].any():
            problems.warn(mjcf.element("joint", joint), "the spring of the joint is left out")
        if model.dof_dampingpoly[dof].any():
            problems.warn(mjcf.element("joint", joint), "only the linear part of its damping is used")
    return found


def read_mimics(mjcf: CompiledMjcf, names: Names, problems: Problems) -> dict[str, Mimic]:
    """Return the joints that follow another one, each after the joint that leads them all.

    An equality of two joints says: q1 - r1 = c0 + c1 (q2 - r2), with the references r of the joints.
    """
    model = mjcf.model
    found: dict[str, Mimic] = {}
    for equality in range(model.neq):
        if not model.eq_active0[equality]:
            continue
        element = mjcf.element("equality", equality)
        kind = mjcf.kind("mjtEq", model.eq_type[equality])
        follower, leader = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
        constant, ratio, *higher = (float(each) for each in model.eq_data[equality][:5])
        if kind != "joint":
            message = (
                f"a robot is a tree of joints, without an equality of type {kind}; remove it, or the bodies it joins"
            )
            problems.error(element, message)
        elif follower not in names or leader not in names or any(higher):
            problems.error(
                element, "a joint can only follow one other in proportion; use joint1, joint2 and polycoef c0 c1"
            )
        elif names[follower] in found:
            problems.error(element, f"{names[follower]!r} follows another joint already; remove one of the equalities")
        else:
            first, second = (float(model.qpos0[model.jnt_qposadr[joint]]) for joint in (follower, leader))
            found[names[follower]] = Mimic(names[leader], ratio, first + constant - ratio * second)
            if _leader(names[follower], found) is None:
                del found[names[follower]]
                problems.error(element, "the joints follow each other in a loop; remove one of the equalities")
    return {name: mimic for name in found if (mimic := _leader(name, found)) is not None}


def _leader(name: str, mimics: Mapping[str, Mimic]) -> Mimic | None:
    """Return how a joint follows the one that leads all; None if there is a loop."""
    mimic = mimics[name]
    for _ in mimics:
        further = mimics.get(mimic.joint)
        if further is None:
            return mimic
        offset = mimic.multiplier * further.offset + mimic.offset
        mimic = replace(mimic, joint=further.joint, multiplier=mimic.multiplier * further.multiplier, offset=offset)
    return None
