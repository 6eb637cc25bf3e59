"""Stepper: applies an action to a cell for one control period, by direct calls, and reads the channels back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import groupby

import numpy as np

from cellwright.cell.cell import Cell
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.config.control import SUCTION_ON, Channel, ControlSpace, period_ticks
from cellwright.config.layout.arms import Arm
from cellwright.engine.clock import nanoseconds
from cellwright.mechanism.gripper_goal import GripperRequest
from cellwright.util.errors import UsageError

NODE = "/policy"
"""Sender of the commands, for robots, which know who commands them."""

Writer = Callable[[list[float]], None]
Reader = Callable[[], list[float]]


class CellStepper:
    """Stepper of a cell: actions in, time on by a control period, values of the channels out.

    Each period is what messages of these targets would make of it, bit for bit. Each joint of an arm gets one straight
    segment from its desired position. Suction and width are set when they change. Robots get their targets as from the
    topic `joint_cmd`.

    Args:
        cell: the cell; nothing else may command its arms.
        rate: control periods in a second [Hz].

    Attributes:
        cell: the cell.
        space: channels of an action.
        ticks: length of a period [ticks].

    Raises:
        UsageError: the cell has nothing to command, or a period would be no whole number of ticks.

    Example:
        >>> from cellwright import Cell, load_trial
        >>> stepper = CellStepper(Cell(load_trial("lesson")), rate=20)
        >>> action = stepper.read()
        >>> action[0] = 0.1  # the rail, 0.1 m in 50 ms
        >>> stepper.step(action)
        >>> stepper.cell.simulation.time
        0.05
    """

    def __init__(self, cell: Cell, rate: float = 20.0) -> None:
        self.cell = cell
        self.space = ControlSpace.of(cell.trial)
        if not self.space.channels:
            raise UsageError(f"trial {cell.trial.name}: there is no arm and no robot to command; add one to its cell")
        timestep = cell.trial.settings.timestep
        self.ticks = period_ticks(rate, timestep)
        self._period = nanoseconds(self.ticks * Fraction(*timestep))
        arms = {arm.namespace: arm for arm in cell.trial.arms}
        self._writers: list[Writer] = []
        self._readers: list[Reader] = []
        self._desires: list[Reader] = []
        numbered = enumerate(self.space.channels)
        for (robot, namespace), group in groupby(numbered, key=lambda each: (each[1].robot, each[1].arm)):
            members = [*group]
            places, channels = slice(members[0][0], members[-1][0] + 1), [channel for _, channel in members]
            if robot:
                self._add_robot(robot, places, channels)
            else:
                self._add_arm(arms[namespace], places, channels)

    def step(self, action: Sequence[float]) -> None:
        """Apply an action, and let a control period pass.

        Args:
            action: a value for each channel, in their units; values out of range are clipped.

        Raises:
            UsageError: it has another length, or a number that is not finite; no time has passed.
            SimulationError: the state has become unstable.
        """
        targets = self.space.targets(action)
        for write in self._writers:
            write(targets)
        step = self.cell.simulation.step
        for _ in range(self.ticks):
            step()

    def read(self) -> list[float]:
        """Return the measured value of each channel: positions, 1 for suction that is on, and widths."""
        return [value for read in self._readers for value in read()]

    def desired(self) -> list[float]:
        """Return the present target of each channel: where joints are to be now, and what was sent to grippers."""
        return [value for read in self._desires for value in read()]

    def _add_arm(self, described: Arm, places: slice, channels: Sequence[Channel]) -> None:
        arm, count = self.cell.arms[described.name], sum(each.kind == "joint" for each in channels)
        joints, period = slice(places.start, places.start + count), self._period
        self._writers.append(lambda targets: arm.steer(targets[joints], period))
        self._readers.append(lambda: arm.read().positions)
        self._desires.append(lambda: arm.controller.trajectory.positions(arm.simulation.now))
        if count == len(channels):
            return
        gripper, last = self.cell.grippers[described.name], places.stop - 1
        if isinstance(gripper, FingerGripper):
            fingers = gripper

            def move(targets: list[float]) -> None:
                if targets[last] != fingers.goal:
                    fingers.goals.command(GripperRequest("", targets[last], 0.0))

            self._writers.append(move)
            self._readers.append(lambda: [fingers.width])
            self._desires.append(lambda: [fingers.goal])
        else:
            cup = gripper
            self._writers.append(lambda targets: cup.set_enabled(targets[last] > SUCTION_ON))
            self._readers.append(lambda: [float(cup.enabled)])
            self._desires.append(lambda: [float(cup.enabled)])

    def _add_robot(self, name: str, places: slice, channels: Sequence[Channel]) -> None:
        robot = next(each for each in self.cell.trial.layout.robots if each.name == name)
        commander, topic = self.cell.robots[name].commander, f"/{robot.namespace}/joint_cmd"
        numbers = np.array([commander.numbers[each.joint] for each in channels], dtype=np.intp)

        def follow(targets: list[float]) -> None:
            if commander.admit(topic, NODE, 0):
                commander.follow(topic, numbers, np.array(targets[places]), guarded=True)
                commander.confirm(topic, NODE, 0)

        self._writers.append(follow)
        self._readers.append(lambda: commander.measured()[numbers].tolist())
        self._desires.append(lambda: commander.limiter.desired[numbers].tolist())
