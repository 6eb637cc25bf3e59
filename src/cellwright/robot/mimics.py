"""Joints that follow another one: they go where that one has them, whatever they are told themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cellwright.config.robot.model import Joint
from cellwright.robot.safety.approach import Approach


class Mimics:
    """The joints of a robot that mimic another.

    Args:
        joints: all joints with one degree of freedom, in the order of their numbers.
        numbers: their numbers, by name.

    Attributes:
        leaders: name of the joint that is followed, by the name of the one that follows.
    """

    def __init__(self, joints: Sequence[Joint], numbers: Mapping[str, int]) -> None:
        followers = [(joint.name, joint.mimic) for joint in joints if joint.mimic is not None]
        self.leaders = {name: mimic.joint for name, mimic in followers}
        self._ways = [
            (numbers[name], numbers[mimic.joint], mimic.multiplier, mimic.offset) for name, mimic in followers
        ]

    def carry(self, approach: Approach) -> None:
        """Put each follower to where its leader's applied position has it, within its own limits [rad; m]."""
        for follower, leader, multiplier, offset in self._ways:
            place = multiplier * approach.applied[leader] + offset
            place = min(max(place, approach.lower[follower]), approach.upper[follower])
            approach.applied[follower] = approach.desired[follower] = place
