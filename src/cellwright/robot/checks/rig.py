"""Test rig of the motion checks: a robot's node that is driven step by step, and the findings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cellwright.middleware.bus import PendingResponse
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.robot.node import RobotNode
from cellwright.robot.servos import Array

NODE = "/motion_check"


@dataclass(frozen=True, slots=True)
class Finding:
    """Finding of a check: the worst figure, its place, and its limit in the same unit.

    `where` is empty if there is only one figure; `note` adds details, `remedy` says what to do after a failure.
    """

    what: str
    worst: float
    limit: float
    unit: str
    where: str = ""
    passed: bool = True
    note: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class MotionReport:
    """Findings of a motion check; `reference` is the file that the motion was compared with, empty for none."""

    robot: str
    reference: str
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """True if all findings passed."""
        return all(finding.passed for finding in self.findings)


class Rig:
    """Node that is driven step by step."""

    def __init__(self, node: RobotNode) -> None:
        self.node, self.config, self.numbers = node, node.config, node.commander.numbers
        self.joint_states: tuple[str, ...] = ()
        """Names in the newest joint states."""
        self.node.bus.subscribe("/io_teleop/joint_states", self._on_joint_states, node=NODE)
        self.timestep = float(self.node.simulation.clock.timestep)

    def begin(self) -> None:
        """Reset the robot."""
        self.node.simulation.reset()

    def send(self, targets: Mapping[str, float]) -> None:
        """Command joints by name [rad; m], before the next step."""
        self._publish("/io_teleop/joint_cmd", list(targets), list(targets.values()))

    def send_grippers(self, statuses: Sequence[float]) -> None:
        """Command all grippers, 0 open to 1 closed, before the next step."""
        self._publish("/io_teleop/target_gripper_status", [], statuses)

    def reset(self) -> tuple[float, str]:
        """Send the robot home; return the time [s] and the reason of a failure, empty for none."""
        started = self.node.simulation.time
        answer: Any = self.node.bus.call("/io_teleop_reset_robot", TriggerRequest(), node=NODE)
        if isinstance(answer, PendingResponse):
            while answer.response is None:
                self.step()
            answer = answer.response
        return self.node.simulation.time - started, "" if answer.success else str(answer.message)

    def step(self) -> Array:
        """Run one step; return the positions of the joints after it [rad; m]."""
        self.node.simulation.step()
        return self.positions

    def run(self, seconds: float) -> tuple[Array, Array]:
        """Run for a time [s].

        Returns:
            Times since now (n) [s] and positions (n, joints) [rad; m], the first of them before the first step.
        """
        count = round(seconds / self.timestep)
        found = np.array([self.positions, *(self.step() for _ in range(count))])
        return self.times(count), found

    def times(self, count: int) -> Array:
        """Return the times (count + 1) [s] before and after each of `count` steps."""
        found: Array = np.arange(count + 1, dtype=np.float64) * self.timestep
        return found

    @property
    def positions(self) -> Array:
        """Return the positions of the joints [rad; m], in the order of their indices."""
        return self.node.driver.read().positions.copy()

    def _publish(self, topic: str, names: Sequence[str], positions: Sequence[float]) -> None:
        self.node.bus.publish(topic, joint_state(names, positions, time=self.node.simulation.now), node=NODE)

    def _on_joint_states(self, message: object) -> None:
        self.joint_states = tuple(getattr(message, "name", ()))
