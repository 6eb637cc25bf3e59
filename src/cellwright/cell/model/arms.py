"""Arms and robots of a cell in the engine."""

from typing import Any

from cellwright.cell.model.arm import add_arm, check_joints
from cellwright.cell.model.contact_bits import give_contact_bits
from cellwright.cell.model.own_arm import add_own_arm
from cellwright.cell.model.own_robot import add_own_robot
from cellwright.config.layout.arm_models import is_on_robot, joints_of
from cellwright.config.layout.arms import Arm
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import Visuals


def add_arms_and_robots(spec: Any, visuals: Visuals, trial: Trial, contact_time: float) -> None:
    """Add the arms and robots of a trial to a model specification, before everything else.

    Arms come first, but for those that robots carry.

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

    def add(arm: Arm) -> None:
        if arm.is_original:
            add_arm(spec, visuals, settings, contact_time, arm)
        else:
            add_own_arm(spec, visuals, arm, trial.arm_models, contact_time, arms=arms)

    carried = [arm for arm in arms if is_on_robot(arm, arms)]
    for arm in arms:
        if arm not in carried:
            add(arm)
    for robot in trial.layout.robots:
        add_own_robot(spec, visuals, robot, trial.robot_models[robot.name])
    for arm in carried:
        add(arm)
    give_contact_bits(spec, trial)
