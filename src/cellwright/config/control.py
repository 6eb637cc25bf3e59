"""Control space of a cell: what a policy or an environment commands in a control period, and in which order."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Final, Literal, Self, TypeAlias

from cellwright.config.layout.arm_models import driven_joints
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.robots import CellRobot
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Joint, JointType
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import UnknownNameError, UsageError

ChannelKind: TypeAlias = Literal["joint", "suction", "width", "closed"]
Unit: TypeAlias = Literal["rad", "m", ""]

TURN: Final = 2.0 * math.pi
"""Range of a joint that turns without end to either side [rad]: a space of actions has bounds."""
SLIDE: Final = 10.0
"""Range of a joint that slides without end to either side [m]."""
SUCTION_ON: Final = 0.5
"""Value above which the suction is on."""
SIDES: Final = ("right", "left")
"""Names of a robot's arms and of its grippers, in the order of its configuration; a third is called by its place."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One number of an action.

    Attributes:
        name: unique name: the joint's, or `suction` or `width`; `ARM/` comes before it where arms are in namespaces,
            `ROBOT/` at a robot.
        kind: `joint`: target position at the end of the period; `suction`: on above `SUCTION_ON`; `width`: distance
            between the pads of a parallel gripper; `closed`: share by which the gripper of a robot's node is closed. An
            arm approaches a target along a straight line, a robot as fast as its servos can.
        unit: unit of its values; empty for the suction.
        low: least value.
        high: greatest value.
        joint: the joint's name in messages; empty for a gripper.
        arm: namespace of the arm below `/ariac`; empty for an arm without one, and at a robot.
        robot: name of the robot in the layout; empty at an arm.
    """

    name: str
    kind: ChannelKind
    unit: Unit
    low: float
    high: float
    joint: str = ""
    arm: str = ""
    robot: str = ""


@dataclass(frozen=True)
class ControlSpace:
    """Channels of a cell: arm by arm its joints in controller order and its gripper, then the joints of each robot.

    Joints of a robot are in the order of its file, without those that mimic another.

    Attributes:
        channels: the channels, in the order of the numbers of an action.

    Example:
        >>> from cellwright import load_trial
        >>> space = ControlSpace.of(load_trial("lesson"))
        >>> space.names[0], space.names[-1], len(space.channels)
        ('linear_arm_actuator_joint', 'suction', 8)
        >>> space.targets([9.0, 0, 0, 0, 0, 0, 0, 1])[0]
        2.1
    """

    channels: tuple[Channel, ...]

    @classmethod
    def of(cls, trial: Trial) -> Self:
        """Return the channels of a trial's cell; a cell without arms and robots has none."""
        found: list[Channel] = []
        for arm in trial.arms:
            found += [_of_arm(arm, joint) for joint in driven_joints(arm, trial.arm_models)]
            found += _of_gripper(arm)
        for robot in trial.layout.robots:
            found += _of_robot(robot, trial.robot_models[robot.name])
        return cls(tuple(found))

    @classmethod
    def of_node(cls, robot: RobotConfig) -> Self:
        """Return the channels of a robot with a controller node of its own.

        They are its joints in the order of its file, without those that mimic another or that a gripper moves, then how
        far each gripper is closed.

        Example:
            >>> from cellwright import load_robot
            >>> space = ControlSpace.of_node(load_robot("tandem"))
            >>> space.names[0], space.names[-2:]
            ('lift', ('gripper_right', 'gripper_left'))
        """
        closing = {name for gripper in robot.grippers for name in gripper.joints}
        joints = (each for each in robot.robot.driven if each.mimic is None and each.name not in closing)
        grippers = (f"gripper_{side_name(number)}" for number in range(len(robot.grippers)))
        return cls(
            (
                *(_of_joint(each.name, each, each.name) for each in joints),
                *(Channel(name, "closed", "", 0.0, 1.0) for name in grippers),
            )
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(each.name for each in self.channels)

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Units of the channels, `rad`, `m` or nothing."""
        return tuple(each.unit for each in self.channels)

    def index(self, name: str) -> int:
        """Return the place of a channel.

        Raises:
            UnknownNameError: there is no such channel.
        """
        if name not in self.names:
            raise UnknownNameError("channel", name, self.names)
        return self.names.index(name)

    def targets(self, action: Sequence[float]) -> list[float]:
        """Return the values of an action, each clipped to its channel's range.

        Args:
            action: a number for each channel, in their order.

        Raises:
            UsageError: it has another length, or a number that is not finite.
        """
        if len(action) != len(self.channels):
            raise UsageError(
                f"action: must have {len(self.channels)} numbers (got {len(action)}); they are {', '.join(self.names)}"
            )
        found = []
        for channel, number in zip(self.channels, action, strict=True):
            value = float(number)
            if not math.isfinite(value):
                raise UsageError(f"action: {channel.name} must be finite (got {value})")
            found.append(min(max(value, channel.low), channel.high))
        return found


def side_name(number: int) -> str:
    """Return the name of an arm or a gripper of a robot by its place in the configuration."""
    return SIDES[number] if number < len(SIDES) else str(number)


def period_ticks(rate: float, timestep: tuple[int, int]) -> int:
    """Return the length of a control period in ticks.

    Args:
        rate: control periods in a second [Hz].
        timestep: length of a tick [s], as numerator and denominator.

    Raises:
        UsageError: a period would be no whole number of ticks.

    Example:
        >>> period_ticks(20, (1, 500)), period_ticks(50.0, (1, 500))
        (25, 10)
        >>> period_ticks(15, (1, 500))  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        cellwright.util.errors.UsageError: rate: ... (got 15 Hz); take 15.1515 or 14.7059 (or a round 20 or 12.5)
    """
    tick = Fraction(*timestep)
    if not (math.isfinite(rate) and 0.0 < rate <= 1 / tick):
        raise UsageError(f"rate: must be above 0 and at most {float(1 / tick):g} Hz (got {rate:g})")
    # a rate such as 31.25 is exact; 29.4118, as the error says it, stands for 500/17
    ticks = 1 / (Fraction(rate) * tick)
    nearest = round(ticks)
    if abs(ticks - nearest) > Fraction(nearest, 100_000):
        below, above = math.floor(ticks), math.ceil(ticks)
        near = " or ".join(f"{float(1 / (each * tick)):g}" for each in (below, above))
        round_ones = " or ".join(f"{float(each):g}" for each in _round_rates(rate, tick))
        raise UsageError(
            f"rate: a period must be whole ticks of {float(tick) * 1000:g} ms (got {rate:g} Hz); take {near}"
            f"{round_ones and f' (or a round {round_ones})'}"
        )
    return nearest


def _round_rates(rate: float, tick: Fraction) -> list[Fraction]:
    """Return the next rates above and below with whole ticks and at most one digit behind the point [Hz]."""
    found = []
    ticks = 1 / (Fraction(rate) * tick)
    for counts in (range(math.floor(ticks), 0, -1), range(math.ceil(ticks), math.floor(10 / tick) + 1)):
        found += [1 / (each * tick) for each in counts if (10 / (each * tick)).denominator == 1][:1]
    return found


def _of_arm(arm: Arm, joint: Joint) -> Channel:
    name, in_messages = f"{arm.start_prefix}{joint.name}", f"{arm.joint_prefix}{joint.name}"
    return _of_joint(name, joint, in_messages, arm=arm.namespace)


def _of_gripper(arm: Arm) -> Iterator[Channel]:
    if arm.tool.kind == "vacuum":
        yield Channel(f"{arm.start_prefix}suction", "suction", "", 0.0, 1.0, arm=arm.namespace)
    if arm.tool.fingers is not None:
        yield Channel(f"{arm.start_prefix}width", "width", "m", 0.0, arm.tool.fingers.opening, arm=arm.namespace)


def _of_robot(robot: CellRobot, config: RobotConfig) -> Iterator[Channel]:
    for joint in config.robot.driven:
        if joint.mimic is None:
            yield _of_joint(f"{robot.prefix}{joint.name}", joint, joint.name, robot=robot.name)


def _of_joint(name: str, joint: Joint, in_messages: str, *, arm: str = "", robot: str = "") -> Channel:
    """Return the channel of a joint; a range without an end gets one."""
    slides = joint.type is JointType.PRISMATIC
    end = SLIDE if slides else TURN
    low, high = (
        value if math.isfinite(value) else math.copysign(end, value)
        for value in (joint.limits.lower, joint.limits.upper)
    )
    return Channel(name, "joint", "m" if slides else "rad", low, high, in_messages, arm, robot)
