"""A client of a robot's node for tests: it sends commands and reads topics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.bus import PendingResponse
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import floats, header, joint_state
from cellwright.middleware.messages.standard import Bool
from cellwright.middleware.messages.std_srvs import SetBoolRequest, TriggerRequest
from cellwright.robot.drivers import Driver
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from tests.robot.robots import two_arms

PREFIX = "/io_teleop/"
RESET = "/io_teleop_reset_robot"


class Talk:
    """A node with simulation time on its messages, its reported lines, and commands to it."""

    def __init__(
        self,
        config: RobotConfig | None = None,
        *,
        safety: SafetySettings | None = None,
        driver: Driver | None = None,
        stamp: Callable[[], int] | None = None,
        **settings: Any,
    ) -> None:
        self.lines: list[str] = []
        chosen = RobotSettings(safety=safety or SafetySettings(), sim_time=True, **settings)
        self.node = RobotNode(config or two_arms(), chosen, report=self.lines.append, stamp=stamp, driver=driver)

    def joints(self, targets: Mapping[str, float], topic: str = "joint_cmd", *, node: str = "/op", at: int = 0) -> None:
        """Send targets by name."""
        self.state(topic, list(targets), targets.values(), node=node, at=at)

    def state(
        self, topic: str, names: list[str], positions: Iterable[float], *, node: str = "/op", at: int = 0
    ) -> None:
        """Send a joint state, valid or not."""
        self.node.bus.publish(PREFIX + topic, joint_state(names, list(positions), time=at), node=node)

    def grippers(self, *statuses: float) -> None:
        """Send the statuses of grippers."""
        self.state("target_gripper_status", [], statuses)

    def base(self, *numbers: float) -> None:
        """Send a command of the base."""
        array, layout = TYPES.message("std_msgs/Float64MultiArray"), TYPES.message("std_msgs/MultiArrayLayout")
        self.node.bus.publish(PREFIX + "target_base_move", array(layout([], 0), floats(numbers)), node="/op")  # type: ignore[call-arg]

    def stop(self, pressed: bool = True) -> None:
        """Press or release the emergency stop."""
        self.node.bus.publish(PREFIX + "emergency_stop", Bool(pressed), node="/op")

    def clear(self) -> Any:
        """Clear the emergency stop."""
        return self.node.bus.call(PREFIX + "clear_emergency_stop", TriggerRequest(), node="/op")

    def enable(self, enabled: bool = True) -> Any:
        """Switch commands on or off."""
        return self.node.bus.call(PREFIX + "set_enabled", SetBoolRequest(data=enabled), node="/op")

    def reset(self) -> Any:
        """Send the robot home; return the response, or the pending one."""
        return self.node.bus.call(RESET, TriggerRequest(), node="/op")

    def steps(self, count: int = 1) -> None:
        """Run some ticks."""
        for _ in range(count):
            self.node.simulation.step()

    def seconds(self, count: float) -> None:
        """Run for a time [s]."""
        self.node.simulation.step_until(self.node.simulation.now + round(count * 1e9))

    def wait_for(self, pending: Any, limit: float = 10.0) -> Any:
        """Run until there is a response."""
        assert isinstance(pending, PendingResponse), pending
        end = self.node.simulation.time + limit
        while pending.response is None:
            assert self.node.simulation.time < end
            self.steps()
        return pending.response

    def at(self, joint: str) -> float:
        """Return the position of a joint [rad; m]."""
        return float(self.node.driver.read().positions[self.number(joint)])

    def velocity(self, joint: str) -> float:
        """Return the speed of a joint [rad/s; m/s]."""
        return float(self.node.driver.read().velocities[self.number(joint)])

    def applied(self, joint: str) -> float:
        """Return the applied target of a joint [rad; m]."""
        return float(self.node.commander.applied[self.number(joint)])

    def number(self, joint: str) -> int:
        """Return the number of a joint among those with one degree of freedom."""
        return self.node.commander.numbers[joint]

    def listen(self, topic: str) -> list[Any]:
        """Collect the messages of a topic from now on."""
        heard: list[Any] = []
        self.node.bus.subscribe(topic if topic.startswith("/") else PREFIX + topic, heard.append)
        return heard

    def top_speed(self, joint: str, seconds: float, meanwhile: Callable[[], None] = lambda: None) -> float:
        """Return the maximum speed [rad/s; m/s] of a joint while time passes; `meanwhile` is called in each tick."""
        top, end = 0.0, self.node.simulation.time + seconds
        while self.node.simulation.time < end:
            meanwhile()
            self.steps()
            top = max(top, abs(self.velocity(joint)))
        return top


def stamped(seconds: float) -> Any:
    """Return a header with a stamp [s]."""
    return header(time=round(seconds * 1e9))
