"""A robot's controller node for long runs: sines on all joints of its arms and legs, and hands that close and open."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from benchmarks.soak.face import ROUND, MessageCounter
from cellwright.config.robot.robots import load_robot
from cellwright.middleware.messages.conversions import joint_state
from cellwright.robot.node import RobotNode, RobotSettings

ROBOT = "qinglong"
COMMANDS = 360
"""Joint commands in a round: 10 a second."""
GRIPS = 12
"""Commands of the hands in a round."""
TURNS = (3.0, 17.0)
"""Periods of the slowest and the fastest joint in a round."""


class RobotFace:
    """The node and its program; see `Face`.

    Args:
        everything: listen to every topic, and not only to the joint states.
    """

    def __init__(self, *, everything: bool = False) -> None:
        config = load_robot(ROBOT, lambda _line: None)
        self.node = RobotNode(config, RobotSettings(sim_time=True))
        self.simulation = self.node.simulation
        self.counts: Counter[str] = Counter()
        counter = MessageCounter(self.node.bus, self.counts)
        published = [topic.name for topic in self.node.bus.topics() if topic.publishers]
        for topic in published if everything else ["/io_teleop/joint_states"]:
            counter.listen(topic)
        joints = [joint for joint in config.robot.driven if joint.mimic is None]
        self._names = [joint.name for joint in joints]
        lower = np.array([max(joint.limits.lower, -1.0) for joint in joints])
        upper = np.array([min(joint.limits.upper, 1.0) for joint in joints])
        self._middle, self._reach = (lower + upper) / 2, (upper - lower) / 2
        self._pulse = 2 * math.pi * np.linspace(*TURNS, len(joints)).round()  # whole periods: every round is alike

    def begin(self) -> None:
        """Do nothing: a robot's node waits for no start."""

    def work(self, number: int) -> None:
        """Run a round."""
        simulation, bus = self.simulation, self.node.bus
        begin = number * ROUND
        for index in range(COMMANDS):
            phase = index / COMMANDS
            targets = self._middle + 0.8 * self._reach * np.sin(self._pulse * phase)
            bus.publish("/io_teleop/joint_cmd", joint_state(self._names, targets, time=simulation.now))
            if index % (COMMANDS // GRIPS) == 0:
                closed = 0.5 - 0.5 * math.cos(2 * math.pi * GRIPS * phase / 4)
                message = joint_state(["right", "left"], [closed, 1.0 - closed], time=simulation.now)
                bus.publish("/io_teleop/target_gripper_status", message)
                self.counts["gripper commands"] += 1
            self.counts["joint commands"] += 1
            simulation.step_until(begin + (index + 1) * ROUND // COMMANDS)
