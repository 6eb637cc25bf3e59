"""ROS 2 side of a served cell or robot: environment, bridge process and its supervision."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.middleware.bridge_host import BridgeHost, BridgeProcess, Serve
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


class Ros2(BridgeHost):
    """Presents a served cell or robot in ROS 2; see `BridgeHost`.

    `others` are the names that ros2_control has, by name of the contract.

    Raises:
        UsageError: there is no ROS 2, or it lacks interfaces.
    """

    kind = "ROS 2"

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

        super().__init__(report, is_stopped)
        self.options = options or Ros2Options()
        self._node = node
        if self.options.names == "2017":
            others = {}
        self._names = {
            name: [other] if self.options.names == "ros2_control" else [name, other]
            for name, other in (others or {}).items()
        }
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
        self._has_started = self._is_joining = False

    def join(self, address: tuple[str, int], serve: Serve) -> bool:
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
        is_ready = self._await(bridge, serve)
        self._is_joining = False
        return is_ready

    def await_change(self, is_stopped: Callable[[], bool]) -> None:
        """Expect that the bridge joins the server of another world, which runs until it `is_stopped`."""
        self.is_stopped = is_stopped
        self._was_ready = False
        if self._bridge is not None:
            self._bridge.is_ready = False

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
        """Forward the output, except the reason that `join` raises."""
        if not (self._is_joining and line.startswith(_REASON)):
            super()._on_line(line)
