"""ROS 2 side of a served cell or robot: environment, bridge process and its supervision."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from cellwright._package import FOLDER
from cellwright.middleware.child import BridgeProcess, RestartDelay, describe_exit, start_bridge
from cellwright.util.errors import UsageError

CELL_NODE = "/cellwright"
"""Node name of a cell in ROS 2. That of a robot is its own."""

RANGE_VARIABLE, OLD_RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"
RANGES = ("localhost", "subnet")
"""Range in which ROS 2 finds other nodes: this machine, or its network."""

NAMES = ("both", "2017", "ros2_control")
"""Names of joint states and of the arm's controller: those of the contract, those of ros2_control, or both."""

_BRIDGE_PROGRAM = Path(FOLDER) / "middleware" / "ros2" / "bridge" / "bridge.py"
_PROFILES = "large_messages.xml"
_REASON = "ROS 2 cannot start: "  # of the bridge's node, in its last line


OLD_PROFILES_VARIABLE, PROFILES_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"
_TRANSPORT_VARIABLES = (OLD_PROFILES_VARIABLE, PROFILES_VARIABLE, "FASTDDS_BUILTIN_TRANSPORTS")


@dataclass(frozen=True)
class Ros2Options:
    """Options of a session's node in ROS 2.

    Attributes:
        discovery: one of `RANGES`.
        names: one of `NAMES`.
        arguments: rclpy's own, without `--ros-args`: `("-r", "__ns:=/cell1")`.
    """

    discovery: str = "localhost"
    names: str = "both"
    arguments: tuple[str, ...] = ()


def discovery_variables(distribution: str, discovery: str) -> dict[str, str]:
    """Return the variables that keep a node's traffic within a range, for any distribution."""
    if distribution in ("humble", "galactic", "foxy"):  # they know no ranges
        return {OLD_RANGE_VARIABLE: "1" if discovery == "localhost" else "0"}
    return {RANGE_VARIABLE: discovery.upper()}


def transport_variables(distribution: str, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that let pictures pass without loss; none if `environment` configures Fast DDS itself."""
    if any(environment.get(name) for name in _TRANSPORT_VARIABLES):
        return {}
    is_old = distribution in ("jazzy", "iron", "humble", "galactic", "foxy")
    return {OLD_PROFILES_VARIABLE if is_old else PROFILES_VARIABLE: str(_BRIDGE_PROGRAM.with_name(_PROFILES))}


class Ros2:
    """Presents a served cell or robot in ROS 2. Close it, or use it in a `with`: this ends the bridge.

    `report` takes a line about a failure or a recovery; no call waits once it `is_stopped`. `others` are the names that
    ros2_control has, by name of the contract.

    Raises:
        UsageError: there is no ROS 2, or it lacks interfaces.
    """

    def __init__(
        self,
        report: Callable[[str], None],
        is_stopped: Callable[[], bool] = lambda: False,
        environment: Mapping[str, str] | None = None,
        *,
        node: str = CELL_NODE,
        others: Mapping[str, str] | None = None,
        options: Ros2Options | None = None,
    ) -> None:
        from cellwright.middleware.ros2.host import installation as installations  # slow to load

        self.report = report
        self.options = options or Ros2Options()
        self._node = node
        if self.options.names == "2017":
            others = {}
        self._names = {
            name: [other] if self.options.names == "ros2_control" else [name, other]
            for name, other in (others or {}).items()
        }
        self.is_stopped = is_stopped
        found = installations.find(environment)
        for note in found.notes:
            report(note)
        own = discovery_variables(found.distribution, self.options.discovery)
        asked = found.environment.get(RANGE_VARIABLE, "")
        if RANGE_VARIABLE in own and asked.upper() not in ("", own[RANGE_VARIABLE], "SYSTEM_DEFAULT"):
            report(f"{RANGE_VARIABLE}={asked} is ignored; the range is {self.options.discovery}, see --ros2-range")
        more = transport_variables(found.distribution, found.environment)
        self._installation = replace(found, environment={**found.environment, **own, **more})
        self.for_programs: Mapping[str, str] = own
        """Environment that leads a program of ROS 2 to the same nodes."""
        self.domain = found.environment.get(installations.DOMAIN_VARIABLE) or "0"
        self._bridge: BridgeProcess | None = None
        self._delay = RestartDelay()
        self._again = 0.0
        self._was_ready = self._has_started = self._is_joining = False
        self._address = ("", 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def join(self, address: tuple[str, int], serve: Callable[[float], object]) -> bool:
        """Start the bridge, and serve clients until all is advertised.

        Args:
            address: host and port of the server.
            serve: serves clients for some time [s]; the bridge is one of them.

        Returns:
            True if everything is advertised; False if it was stopped before.

        Raises:
            UsageError: it failed; the text has the reason.
        """
        self._address = address
        if self.is_stopped():
            return False
        try:
            bridge = self._start() if self._bridge is None or self._bridge.poll() is not None else self._bridge
        except OSError as error:
            raise UsageError(f"the ROS 2 bridge could not be started: {error}") from None
        self._is_joining = True
        self._was_ready = start_bridge(bridge, "ROS 2", serve, self.is_stopped, lambda line: self.report(line))
        self._is_joining = False
        return self._was_ready

    @property
    def bridge_pid(self) -> int | None:
        """Process id of the bridge; None if it does not run."""
        return None if self._bridge is None else self._bridge.pid

    def await_change(self, is_stopped: Callable[[], bool]) -> None:
        """Expect that the bridge joins the server of another world, which runs until it `is_stopped`."""
        self.is_stopped = is_stopped
        self._was_ready = False
        if self._bridge is not None:
            self._bridge.is_ready = False

    def poll(self) -> None:
        """Check the bridge, and restart it if it has ended; call it often, and from the same thread."""
        try:
            if self._bridge is not None:
                self._look_at(self._bridge)
            elif time.monotonic() >= self._again:
                self._start()
        except OSError as error:  # no memory, process or file descriptor left on this machine
            self._again = time.monotonic() + self._delay.after(0.0)
            self.report(f"the ROS 2 bridge could not be started: {error}; trying again")

    def _look_at(self, bridge: BridgeProcess) -> None:
        status = bridge.poll()
        if bridge.is_ready and not self._was_ready:
            self._was_ready = True
            self.report("all topics and services are in ROS 2 again")
        if status is None:
            return
        self._bridge = None
        self._was_ready = False
        bridge.stop()
        self._again = time.monotonic() + self._delay.after(time.monotonic() - bridge.started)
        self.report(f"the ROS 2 bridge {describe_exit(status)}; restarting it")

    def close(self) -> None:
        """End the bridge; it leaves the graph first."""
        bridge, self._bridge = self._bridge, None
        if bridge is not None:
            bridge.stop()

    def _start(self) -> BridgeProcess:
        arguments = [f"--name={self._node}", f"--names={json.dumps(self._names)}"]
        if self._has_started:
            arguments.append("--restarted")
        self._has_started = True
        if self.options.arguments:
            arguments += ["--ros-args", *self.options.arguments]
        self._bridge = BridgeProcess(
            _BRIDGE_PROGRAM,
            self._address,
            arguments,
            python=self._installation.python,
            environment=self._installation.environment,
            on_line=self._on_line,
        )
        return self._bridge

    def _on_line(self, line: str) -> None:
        """Forward the bridge's output, except complaints about its disconnection, and the reason that `join` raises."""
        if not self.is_stopped() and not (self._is_joining and line.startswith(_REASON)):
            self.report(f"ROS 2: {line}")
