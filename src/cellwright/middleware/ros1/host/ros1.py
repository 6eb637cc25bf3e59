"""ROS 1 side of a served cell or robot: node identity, parameters, bridge process and its supervision.

The order is that of the original's launch: `/use_sim_time` first, because programs read it once at their start; then
the cell is built; then the other parameters, then the bridge. No time passes before all of this is ready, so that the
first /clock is the sign that the cell is ready.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cellwright._package import FOLDER
from cellwright.middleware.bridge_host import BridgeHost, BridgeProcess, Serve
from cellwright.middleware.ros1.host import installation as installations
from cellwright.middleware.ros1.host.master import DEFAULT_URI, URI_VARIABLE, MasterClient, MasterError, OwnMaster
from cellwright.middleware.ros1.identity import Identity
from cellwright.util.errors import UsageError

_BRIDGE_PROGRAM = Path(FOLDER) / "middleware" / "ros1" / "bridge" / "bridge.py"
_AGAIN = 0.5  # time [s] between two attempts to reach a lost master


class Ros1(BridgeHost):
    """Presents a served cell or robot in ROS 1; see `BridgeHost`."""

    kind = "ROS 1"

    def __init__(
        self,
        report: Callable[[str], None],
        is_stopped: Callable[[], bool] = lambda: False,
        environment: Mapping[str, str] | None = None,
        *,
        identity: Identity,
    ) -> None:
        super().__init__(report, is_stopped)
        self.identity = identity
        self._installation = installations.find(environment)
        here = self._installation.environment
        self.master = MasterClient(here.get(URI_VARIABLE) or DEFAULT_URI)
        own = {URI_VARIABLE: self.master.uri}
        if self.master.is_local and not here.get("ROS_IP") and not here.get("ROS_HOSTNAME"):
            # No access from other machines unless requested.
            own["ROS_IP"] = "127.0.0.1"
        self.for_programs: Mapping[str, str] = own
        """Environment that leads a program of ROS 1 to the same master."""
        self._installation = replace(self._installation, environment={**here, **own})
        self._own_master: OwnMaster | None = None
        self._preparation: threading.Thread | None = None
        self._closed = threading.Event()
        self._parameters: Mapping[str, Any] = {}

    def prepare(self) -> None:
        """Ensure a master, and set `/use_sim_time` if time is simulated; call it before anything slow.

        Raises:
            UsageError: there is no master and none can be started, or another node has the same name.
        """
        try:
            if self.master.answers():
                self._refuse_another()
                topic = self.identity.exclusive_topic
                for rival in self.master.living_publishers(topic) if topic else ():
                    where = f"{topic} at {self.master.uri}"
                    self.report(f"{rival} also publishes {where}: programs receive from both and command both")
            elif self.master.is_local:
                self._own_master = OwnMaster(self._installation, self.master, lambda line: self.report(line))
                self._own_master.wait(self.is_stopped)
                if self.is_stopped():
                    return
                self._own_master.mark()
            else:
                raise UsageError(
                    f"no ROS master answers at {self.master.uri}, which is not on this machine; check {URI_VARIABLE}"
                )
            self._settle_time()
        except MasterError as error:
            raise UsageError(f"the ROS master failed: {error}") from None
        except OSError as error:
            raise UsageError(f"the ROS master could not be started: {error}") from None

    def join(self, address: tuple[str, int], parameters: Mapping[str, Any], serve: Serve) -> bool:
        """Set the parameters, start the bridge, and serve clients until all is registered.

        Args:
            address: host and port of the server.
            parameters: nested dictionaries.
            serve: serves clients, of which the bridge is one.

        Returns:
            True if everything is registered; False if it was stopped before.

        Raises:
            UsageError: it failed; the text has the reason.
        """
        self._address, self._parameters = address, parameters
        if self.is_stopped():
            return False
        try:
            self._set_parameters()
            bridge = self._start()
        except MasterError as error:
            raise UsageError(f"the ROS master failed: {error}") from None
        except OSError as error:
            raise UsageError(f"the ROS 1 bridge could not be started: {error}") from None
        return self._await(bridge, serve)

    def _look_after(self) -> None:
        if self._own_master is not None:
            self._own_master.poll()
        if self._bridge is not None:
            self._look_at(self._bridge)
        elif self._preparation is not None:
            if not self._preparation.is_alive():
                self._preparation = None
                self._start()
        elif time.monotonic() >= self._again:
            self._preparation = threading.Thread(target=self._prepare_again, name="ros-parameters", daemon=True)
            self._preparation.start()

    def _prepare_again(self) -> None:
        """Prepare the start of a bridge: a master with the parameters, and no other node as the simulator."""
        has_reported = False
        while not self._closed.is_set():
            try:
                if self.master.living_node(self.identity.node) is not None:
                    if not has_reported:
                        self.report(
                            f"another node has the name {self.identity.node} now; "
                            f"the {self.identity.kind} registers again when that node ends"
                        )
                    has_reported = True
                    self._closed.wait(_AGAIN)
                    continue
                if self._own_master is not None:
                    self._own_master.mark()
                self._set_parameters()
                return
            except MasterError:
                self._closed.wait(_AGAIN)

    def close(self) -> None:
        """End all that was started, the bridge first: it unregisters at the master."""
        self._closed.set()
        super().close()
        own, self._own_master = self._own_master, None
        if own is not None:
            own.stop()

    def _start(self) -> BridgeProcess:
        identity = self.identity
        self._bridge = BridgeProcess(
            _BRIDGE_PROGRAM,
            self._address,
            [
                f"--name={identity.node}",
                f"--robot-state-publisher={'auto' if identity.frame_source else 'none'}",
                f"--frame-source={identity.frame_source}",
                f"--subscribe={','.join(identity.subscribes)}",
            ],
            python=self._installation.python,
            environment=self._installation.environment,
            on_line=self._on_line,
        )
        return self._bridge

    def _refuse_another(self) -> None:
        name = self.identity.node
        node = self.master.living_node(name)
        if node is None:
            return
        if self.identity.rival:
            raise UsageError(
                f"{self.identity.rival} already runs at {self.master.uri}: its node {name} answers at {node}"
            )
        raise UsageError(
            f"node {name} already runs at {self.master.uri}: it answers at {node}; stop it, or choose another name"
        )

    def _settle_time(self) -> None:
        """Set `/use_sim_time` for programs, which read it once at their start."""
        if self.identity.tells_time:
            self.master.set_parameter("/use_sim_time", value=True)
        elif self.master.parameter("/use_sim_time"):
            self.report(
                f"/use_sim_time is true at {self.master.uri}, but {self.identity.node} uses wall time: for new "
                "programs time stands still unless /clock has a publisher; run `rosparam set /use_sim_time false`"
            )

    def _set_parameters(self) -> None:
        """Set the node's parameters, and the global ones that no other program has set.

        A global parameter with the same value as the node's own is from an earlier run, and is replaced.
        """
        own, master = self.identity.node, self.master
        free = [
            name
            for name in self.identity.shared
            if (there := master.parameter(f"/{name}")) is None or there == master.parameter(f"{own}/{name}")
        ]
        master.set_parameters(self._parameters)
        for name in free:
            if (value := master.parameter(f"{own}/{name}")) is not None:
                master.set_parameter(f"/{name}", value)
