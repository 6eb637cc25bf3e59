"""Somebody who commands a robot's node in a test, and listens to it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.bus import Later
from cellwright.middleware.messages import message_type
from cellwright.middleware.messages.conversions import floats, header, joint_state
from cellwright.middleware.messages.standard import Bool
from cellwright.middleware.messages.std_srvs import SetBoolRequest, TriggerRequest
from cellwright.robot.node import RobotNode
from cellwright.robot.safety import SafetySettings
from tests.robot.robots import two_arms

PREFIX = "/io_teleop/"
RESET = "/io_teleop_reset_robot"


class Talk:
    """A node with simulation time on its messages, what it reported, and words to it."""

    def __init__(self, config: RobotConfig | None = None, *, safety: SafetySettings | None = None, **more: Any) -> None:
        self.lines: list[str] = []
        self.node = RobotNode(
            config or two_arms(), safety=safety or SafetySettings(), sim_time=True, report=self.lines.append, **more
        )

    def joints(self, targets: Mapping[str, float], topic: str = "joint_cmd", *, node: str = "/op", at: int = 0) -> None:
        """Targets by name."""
        self.state(topic, list(targets), targets.values(), node=node, at=at)

    def state(
        self, topic: str, names: list[str], positions: Iterable[float], *, node: str = "/op", at: int = 0
    ) -> None:
        """A joint state, whatever is in it."""
        self.node.bus.publish(PREFIX + topic, joint_state(names, list(positions), time=at), node=node)

    def grippers(self, *statuses: float) -> None:
        """How far grippers are to be closed."""
        self.state("target_gripper_status", [], statuses)

    def base(self, *numbers: float) -> None:
        """A command of the base."""
        array, layout = message_type("std_msgs/Float64MultiArray"), message_type("std_msgs/MultiArrayLayout")
        self.node.bus.publish(PREFIX + "target_base_move", array(layout([], 0), floats(numbers)), node="/op")  # type: ignore[call-arg]

    def stop(self, pressed: bool = True) -> None:
        """The emergency stop."""
        self.node.bus.publish(PREFIX + "emergency_stop", Bool(pressed), node="/op")

    def clear(self) -> Any:
        """End the emergency stop."""
        return self.node.bus.call(PREFIX + "clear_emergency_stop", TriggerRequest(), node="/op")

    def enable(self, wanted: bool = True) -> Any:
        """Switch commands on or off."""
        return self.node.bus.call(PREFIX + "set_enabled", SetBoolRequest(data=wanted), node="/op")

    def reset(self) -> Any:
        """Ask for the way home; the answer, or what will be."""
        return self.node.bus.call(RESET, TriggerRequest(), node="/op")

    def steps(self, count: int = 1) -> None:
        """Let ticks pass."""
        for _ in range(count):
            self.node.simulation.step()

    def seconds(self, count: float) -> None:
        """Let time pass [s]."""
        self.node.simulation.step_until(self.node.simulation.now + round(count * 1e9))

    def wait_for(self, later: Any, limit: float = 10.0) -> Any:
        """Let time pass until there is an answer."""
        assert isinstance(later, Later), later
        end = self.node.simulation.time + limit
        while later.response is None:
            assert self.node.simulation.time < end
            self.steps()
        return later.response

    def at(self, joint: str) -> float:
        """Where a joint stands [rad; m]."""
        return float(self.node.driver.read().positions[self.number(joint)])

    def velocity(self, joint: str) -> float:
        """How fast it moves [rad/s; m/s]."""
        return float(self.node.driver.read().velocities[self.number(joint)])

    def applied(self, joint: str) -> float:
        """What it is given [rad; m]."""
        return float(self.node.commander.applied[self.number(joint)])

    def number(self, joint: str) -> int:
        """Its number among the joints with one degree of freedom."""
        return self.node.commander.numbers[joint]

    def listen(self, topic: str) -> list[Any]:
        """What is said on a topic from now on."""
        heard: list[Any] = []
        self.node.bus.subscribe(topic if topic.startswith("/") else PREFIX + topic, heard.append)
        return heard

    def top_speed(self, joint: str, seconds: float, meanwhile: Callable[[], None] = lambda: None) -> float:
        """The greatest speed [rad/s; m/s] of a joint while time passes; `meanwhile` is called in each tick."""
        top, end = 0.0, self.node.simulation.time + seconds
        while self.node.simulation.time < end:
            meanwhile()
            self.steps()
            top = max(top, abs(self.velocity(joint)))
        return top


def stamped(seconds: float) -> Any:
    """A header of that time."""
    return header(time=round(seconds * 1e9))
