"""The bridge's process as its parent sees it."""

from __future__ import annotations

import signal
from collections.abc import Callable
from ipaddress import ip_address
from pathlib import Path

import cellwright
from cellwright.middleware.ros1.host.children import Child
from cellwright.middleware.ros1.host.identity import Identity
from cellwright.middleware.ros1.host.installation import Installation

MASTER_IS_BACK = 75
"""The bridge's exit status when the master was lost and answers again: everything has to be registered anew."""

_PROGRAM = Path(cellwright.__file__).parent / "middleware" / "ros1" / "bridge" / "__main__.py"
_READY = "ready"


class Bridge:
    """One run of the bridge.

    Args:
        installation: the ROS 1 to run under.
        identity: as whom what is served is known.
        address: host and port at which it is served.
        say: takes what it says, a line at a time.
    """

    def __init__(
        self, installation: Installation, identity: Identity, address: tuple[str, int], say: Callable[[str], None]
    ) -> None:
        self.is_ready = False
        """Whether everything is registered."""
        self.last_line = ""
        self._say = say
        host, port = address
        if ip_address(host).is_unspecified:
            host = "127.0.0.1"
        self._child = Child(
            [
                installation.python,
                str(_PROGRAM),
                f"--connect={host}:{port}",
                f"--name={identity.node}",
                f"--robot-state-publisher={'auto' if identity.makes_frames else 'none'}",
            ],
            installation.environment,
            python=installation.python,
            parting=signal.SIGTERM,
            on_output=self._hear_output,
            on_error=self._hear,
        )

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._child.pid

    @property
    def started(self) -> float:
        """When it was started [s] of `time.monotonic`."""
        return self._child.started

    def poll(self) -> int | None:
        """Hear what it says; its exit status, None while it runs."""
        return self._child.poll()

    def stop(self) -> None:
        """End it, in a few seconds at most."""
        self._child.stop()

    def _hear_output(self, line: str) -> None:
        if line == _READY:
            self.is_ready = True

    def _hear(self, line: str) -> None:
        self.last_line = line
        self._say(line)
