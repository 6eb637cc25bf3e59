"""Which joints belong to a hand: a robot configuration names those that open and close it, and no others."""

from __future__ import annotations

from cellwright.config.robot.config import RobotConfig

RIGHT, LEFT = 0, 1
"""Places of the two sides in a configuration's lists of arms and grippers."""


def hand_joints(config: RobotConfig, side: int) -> frozenset[str] | None:
    """The joints of a hand, by name: those of the gripper, and all that hang below the last joint of the arm.

    None where the configuration has neither arms nor grippers, so that nothing is known of hands.
    """
    if not config.arms and not config.grippers:
        return None
    found: set[str] = set()
    if side < len(config.grippers):
        found.update(config.grippers[side].joints)
    if side < len(config.arms) and config.arms[side].joints:
        robot, wrist = config.robot, config.arms[side].joints[-1]
        arm = set(config.arms[side].joints)
        found.update(
            joint.name
            for joint in robot.driven
            if joint.name not in arm and any(above.name == wrist for above in robot.chain(joint.child))
        )
    return frozenset(found)
