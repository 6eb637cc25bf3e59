"""Bridges to ROS: their processes, and the supervision that both versions of ROS have in common.

One thread calls everything here, as of `child.py`. No call waits longer than documented.
"""

from __future__ import annotations

import re
import signal
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from ipaddress import ip_address
from pathlib import Path
from typing import ClassVar, Self

from cellwright.middleware.child import READY_LIMIT, Child, RestartDelay, Waiting, describe_exit
from cellwright.util.errors import UsageError

Serve = Callable[[float], object]
"""Serves the clients of a cell or robot for some time [s]; a bridge is one of them."""

REGISTER_AGAIN = 75
"""Exit status of a bridge of ROS 1 if a lost master answers again: everything has to be registered again."""
_READY_LINE = "ready"
_COLOURS = re.compile(r"\x1b\[[\d;]*m")
_SERVING = 0.02  # [s]
_WHERE_TO_LOOK = "see the variables that `printenv | grep ROS` prints, and the newest log of ~/.ros/log"


class BridgeHost(ABC):
    """Presents a served cell or robot in ROS. Close it, or use it in a `with`: this ends all that it started.

    `report` takes a line about a failure or a recovery; no call waits once it `is_stopped`.
    """

    kind: ClassVar[str]
    """Name of its ROS in sentences."""

    def __init__(self, report: Callable[[str], None], is_stopped: Callable[[], bool]) -> None:
        self.report = report
        self.is_stopped = is_stopped
        self._bridge: BridgeProcess | None = None
        self._delay = RestartDelay()
        self._again = 0.0
        self._was_ready = False
        self._address = ("", 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def bridge_pid(self) -> int | None:
        """Process id of the bridge; None if it does not run."""
        return None if self._bridge is None else self._bridge.pid

    def poll(self) -> None:
        """Check what was started, and restart what has ended; call it often, and from the same thread."""
        try:
            self._look_after()
        except OSError as error:  # no memory, process or file descriptor left on this machine
            self._again = time.monotonic() + self._delay.after(0.0)
            self.report(f"a {self.kind} program could not be started: {error}; trying again")

    def close(self) -> None:
        """End the bridge; it leaves the graph first."""
        bridge, self._bridge = self._bridge, None
        if bridge is not None:
            bridge.stop()

    @abstractmethod
    def _start(self) -> BridgeProcess:
        """Start the bridge."""

    def _look_after(self) -> None:
        if self._bridge is not None:
            self._look_at(self._bridge)
        elif time.monotonic() >= self._again:
            self._start()

    def _await(self, bridge: BridgeProcess, serve: Serve) -> bool:
        """Serve clients until the bridge is ready, as `start_bridge` does."""
        self._was_ready = start_bridge(bridge, self.kind, serve, self.is_stopped, lambda line: self.report(line))
        return self._was_ready

    def _look_at(self, bridge: BridgeProcess) -> None:
        """Forward the output of the bridge; if it has ended, it is to start again, after a delay if it failed."""
        status = bridge.poll()
        if bridge.is_ready and not self._was_ready:
            self._was_ready = True
            self.report(f"all topics and services are in {self.kind} again")
        if status is None:
            return
        self._bridge, self._was_ready = None, False
        bridge.stop()
        self._again = time.monotonic()
        if status != REGISTER_AGAIN:
            self._again += self._delay.after(time.monotonic() - bridge.started)
            self.report(f"the {self.kind} bridge {describe_exit(status)}; restarting it")

    def _on_line(self, line: str) -> None:
        """Forward the bridge's output, except complaints about its disconnection at the end."""
        if not self.is_stopped():
            self.report(f"{self.kind}: {line}")


class BridgeProcess(Child):
    """One run of a bridge to the server at an address; `on_line` takes what it prints on stderr, line by line."""

    def __init__(
        self,
        program: Path,
        address: tuple[str, int],
        arguments: Sequence[str],
        *,
        python: str,
        environment: Mapping[str, str],
        on_line: Callable[[str], None],
    ) -> None:
        self.is_ready = False  # true if everything is registered
        # On stderr, and on stdout, where libraries of ROS have errors too.
        self.last_line = self.last_printed = ""
        self._on_line = on_line
        host, port = address
        if ip_address(host).is_unspecified:
            host = "127.0.0.1"
        super().__init__(
            [python, str(program), f"--connect={host}:{port}", *arguments],
            environment,
            python=python,
            parting=signal.SIGTERM,
            on_output=self._on_output,
            on_error=self._on_error_line,
        )

    def _on_output(self, line: str) -> None:
        if line == _READY_LINE:
            self.is_ready = True
        else:
            self.last_printed = _COLOURS.sub("", line)

    def _on_error_line(self, line: str) -> None:
        self.last_line = line
        self._on_line(line)


def start_bridge(
    bridge: BridgeProcess,
    kind: str,
    serve: Callable[[float], object],
    is_stopped: Callable[[], bool],
    report: Callable[[str], None],
) -> bool:
    """Serve clients until a bridge is ready; return whether it is, or False if it was stopped before.

    Args:
        bridge: a client of the server.
        kind: its purpose, in a word.
        serve: serves clients for some time [s].
        is_stopped: returns whether the session has been stopped.
        report: takes a line about a start that takes long.

    Raises:
        UsageError: it has ended, or is not ready after `READY_LIMIT`.
    """
    waiting = Waiting(f"the {kind} bridge", report)
    while not bridge.is_ready and not is_stopped():
        serve(_SERVING)
        status = bridge.poll()
        if status is not None or waiting.is_over():
            how = f"is not ready after {READY_LIMIT:g} s" if status is None else describe_exit(status)
            why = bridge.last_line or bridge.last_printed or f"it gave no reason; {_WHERE_TO_LOOK}"
            raise UsageError(f"the {kind} bridge {how}: {why}")
    return bridge.is_ready
