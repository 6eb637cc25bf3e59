"""Arm of any model in the engine: links on their mount, drives, and a suction cup or a parallel gripper."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import mujoco

from cellwright.cell.model.arm import CUP_FACE_GEOM, CUP_GEOM
from cellwright.cell.model.arm_looks import dress_cup
from cellwright.cell.model.own_models import add_link
from cellwright.config.layout.arm_models import RAIL, ArmModel, arm_model, bare_arm, home_of, joints_of, laden
from cellwright.config.layout.arms import Arm
from cellwright.config.parsing.findings import Finding
from cellwright.config.robot.model import Link
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import GRIPPER
from cellwright.engine.shapes import Touch, Visuals
from cellwright.mechanism.chain import add_chain
from cellwright.mechanism.drives import add_drive, give_link_mass, given_drive, stiff_drives
from cellwright.mechanism.gripper_model import Contacts, add_parallel_gripper
from cellwright.mechanism.link_shapes import with_collision_shapes
from cellwright.motion.chain import chain_of
from cellwright.motion.home import home_fault
from cellwright.util.errors import CellwrightError

_BEAM_BITS = (2, 0)
"""Contacts of a rail's beam: with parts alone, since carriages of arms overlap it by design."""


def arm_problems(trial: Trial) -> list[Finding]:
    """Return what is wrong with the models of a trial's arms beyond their descriptions."""
    problems = []
    for arm in trial.arms:
        if arm.is_original:
            continue
        model = trial.arm_models[arm.name]
        try:
            spec = mujoco.MjSpec()
            spec.compiler.degree = False
            add_own_arm(spec, Visuals(), arm, trial.arm_models, 0.01)
            spec.compile()
        except (ValueError, CellwrightError) as error:
            reason = " ".join(str(error).split())
            problems.append(Finding(f"cell.arms.{arm.name}", f"the engine cannot build this arm: {reason}"))
        chain = chain_of(model.robot, arm.tip)
        home = home_of(arm, joints_of(arm, trial.arm_models))
        if fault := home_fault(chain, [home[joint.name] for joint in chain.joints]):
            problems.append(Finding(f"cell.arms.{arm.name}.home", fault))
    return problems


def add_own_arm(
    spec: Any,
    visuals: Visuals,
    arm: Arm,
    models: Mapping[str, ArmModel],
    contact_time: float,
    *,
    arms: Sequence[Arm] = (),
) -> None:
    """Add an arm to a model specification.

    Its weight is compensated, and its links do not touch each other.

    Args:
        spec: model specification.
        visuals: receives what is only seen of it.
        arm: the arm.
        models: models of the arms, by name.
        contact_time: time constant [s] of the contacts of cup or fingers.
        arms: arms of the cell, of which one may carry this one, and others stand on it; by default it is alone.

    Raises:
        ModelFileError: a mesh cannot be used.
        UsageError: convex pieces cannot be made.
    """
    model, on = models[arm.name], arm.mount.on if arms else None
    touched = replace(model, robot=with_collision_shapes(model.robot, model.collision))
    robot, fingers = arm_model(arm, touched, arm.prefix), arm.tool.fingers
    beam, cup = f"{arm.prefix}{RAIL}", f"{arm.prefix}{GRIPPER}"

    def fill(body: Any, link: Link) -> None:
        give_link_mass(body, link)
        body.gravcomp = 1.0
        for geom in add_link(spec, visuals, body, link):
            if link.name == beam:
                geom.contype, geom.conaffinity = _BEAM_BITS
        if link.name == cup:
            dress_cup(spec, visuals, body, arm.prefix + CUP_GEOM, arm.prefix + CUP_FACE_GEOM, contact_time)

    # descriptions have inertias that no body has; the engine takes the nearest that one can have
    spec.compiler.balanceinertia = True
    chain = robot if fingers is None else bare_arm(arm, touched, arm.prefix)
    parent, pose = (spec.worldbody, arm.pose) if on is None else (spec.body(on.body), on.pose)
    joints = add_chain(parent, chain, fill, pose=pose)
    for name, drive in stiff_drives(laden(arm, arms, models), arm.bandwidth).items():
        if name in joints:
            given = model.drives.get(name.removeprefix(arm.prefix))
            add_drive(spec, joints[name], drive if given is None else given_drive(given, drive.effort))
    if fingers is not None:
        contacts, tip = Contacts(Touch.ROBOT.value, contact_time), spec.body(arm.prefix + arm.tip)
        add_parallel_gripper(spec, tip, fingers, arm.gripper_names, contacts, arm.tool.palm_distance)
