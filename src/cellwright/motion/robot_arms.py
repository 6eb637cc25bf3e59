"""Arms of a robot as chains: from the link that carries an arm to its tip, and from the world to that link."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cellwright.config.control import side_name
from cellwright.config.robot.config import RobotConfig, initial_posture
from cellwright.config.robot.model import Joint, JointType, link_poses
from cellwright.motion.chain import Chain, chain_of
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class RobotArm:
    """An arm of a robot.

    Attributes:
        name: `right` or `left`, as in the robot's configuration; a third is called by its place.
        chain: from the link that carries the arm to the one whose pose is commanded; joints have their names in the
            robot's file.
        world_T_begin: frame in which the mount begins [m]; that of the carrying link where there is no mount.
        mount: from there to the link that carries the arm, over joints such as a lift; None if none moves it.
    """

    name: str
    chain: Chain
    world_T_begin: Pose
    mount: Chain | None = None


def robot_arms(robot: RobotConfig, world_T_robot: Pose | None = None) -> tuple[RobotArm, ...]:
    """Return the arms of a robot that one chain describes.

    An arm is left out if other joints are between its first joint and its tip, or one that no program drives. It is
    also left out if joints between the fixed link and the root move it.

    Args:
        robot: the robot.
        world_T_robot: frame of its root, or of the link that its configuration fixes; that of the configuration by
            default.

    Example:
        >>> from cellwright import load_robot
        >>> right, left = robot_arms(load_robot("tandem"))
        >>> len(right.chain.joints), [joint.name for joint in left.mount.joints]
        (6, ['lift'])
    """
    world_T_fixed = robot.base_pose if world_T_robot is None else world_T_robot
    found = (_arm(robot, world_T_fixed, number) for number in range(len(robot.arms)))
    return tuple(each for each in found if each is not None)


def _arm(robot: RobotConfig, world_T_fixed: Pose, number: int) -> RobotArm | None:
    """Return an arm; None if no chain describes it."""
    model, arm = robot.robot, robot.arms[number]
    if not arm.joints:
        return None
    tip = robot.command_links[number] if number < len(robot.command_links) else arm.tip
    fixed = robot.fixed_link or model.root
    carrier = model.joint(arm.joints[0]).parent
    to_fixed, to_carrier = model.chain(fixed), model.chain(carrier)
    shared = sum(one is other for one, other in zip(to_fixed, to_carrier, strict=False))
    begin = to_fixed[shared - 1].child if shared else model.root
    if not all(map(_is_rigid, to_fixed[shared:])):
        return None
    is_still = all(map(_is_rigid, to_carrier[shared:]))
    try:
        chain = _alone(chain_of(model, tip, base=carrier))
        mount = None if is_still else _alone(chain_of(model, carrier, base=begin))
    except UsageError:  # a joint that mimics another, or that no program drives
        return None
    if tuple(joint.name for joint in chain.joints) != arm.joints:
        return None
    poses = link_poses(model, initial_posture(robot))
    world_T_begin = world_T_fixed @ poses[fixed].relative(poses[carrier if is_still else begin])
    return RobotArm(side_name(number), chain, world_T_begin, mount)


def _alone(chain: Chain) -> Chain:
    """Return a chain without the links that it carries: fingers, and all other limbs."""
    return replace(chain, links={})


def _is_rigid(joint: Joint) -> bool:
    return joint.type is JointType.FIXED
