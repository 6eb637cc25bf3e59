"""ROS 1 transport: a relay process under the system's Python for programs that have no rospy.

The relay is an ordinary node, and speaks to this client as a served cell would. Over a cell in lockstep the result is
that of a run in one process. Unlike other transports, and as always in ROS, it does not report refused messages to
their publisher; the cell logs them, and continues.
"""

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cellwright._package import FOLDER
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.middleware.messages import type_of
from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.util.errors import UsageError
from cellwright.util.process import ChildProcess

PROGRAM = Path(FOLDER) / "middleware" / "ros1" / "bridge" / "relay.py"
DECLARE = "relay:type"

_START_TIME = 120.0  # [s], for its own start on a busy machine; without a simulator it ends before
_LEAVING = 2.0


class RelayTransport(SocketTransport):
    """Transport through a relay, a process of its own that `command` starts.

    Args:
        command: program and arguments; it prints the port when it is ready.
        environment: of the relay; this process's own by default.
        node: absolute name of the client's node.
        encoding: of messages, `ros1` or `ros2`.
        timeout: longest wait [s] for a simulator to appear.

    Raises:
        UsageError: the relay cannot be started, or it found no simulator.
    """

    knows_all_topics = False

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str] | None, *, node: str, encoding: str, timeout: float
    ) -> None:
        try:
            self._relay = ChildProcess(
                list(command),
                environment=environment,
                stderr=tempfile.TemporaryFile(),  # noqa: SIM115 (closed with the process)
            )
        except OSError as error:
            raise UsageError(f"{command[0]} cannot be started: {error.strerror or error}") from None
        try:
            super().__init__(("127.0.0.1", self._port(timeout + _START_TIME)), node=node, encoding=encoding)
        except BaseException:
            self._relay.end(_LEAVING)
            raise

    def close(self) -> None:
        """Disconnect from the cell; the relay ends."""
        super().close()
        self._relay.end(_LEAVING)

    def _port(self, timeout: float) -> int:
        """Return the port that the relay prints when it is ready."""
        word, _, port = self._relay.ready_line(timeout).partition(" ")
        if word == "ready" and port.isdigit():
            return int(port)
        raise UsageError(self._relay.last_output() or f"the relay is not ready after {timeout:g} s")


class Ros1Transport(RelayTransport):
    """Transport to a cell in ROS 1.

    Args:
        python: an interpreter that has rospy.
        node: absolute name of the client's node.
        environment: of the relay, which names the master; this process's own by default.
        timeout: longest wait [s] for a simulator to appear.
        sign: a topic that is published exactly while a simulator is there.

    Raises:
        UsageError: there is no master or no simulator, or the relay cannot be started.
    """

    def __init__(
        self,
        python: str = "/usr/bin/python3",
        *,
        node: str = "/agent",
        environment: Mapping[str, str] | None = None,
        timeout: float = 30.0,
        sign: str = "/clock",
    ) -> None:
        self._declared: set[str] = set()
        command = [python, str(PROGRAM), f"--node={node}", f"--wait={timeout}", f"--sign={sign}"]
        super().__init__(command, environment, node=node, encoding="ros1", timeout=timeout)

    def publish(self, topic: str, message: Any) -> None:
        """Send a message; a refusal by the cell is not reported."""
        name = type_of(message) if hasattr(message, "__msgtype__") else ""
        if name and name not in self._declared:
            description = {"type": name, "md5": self.types.md5(name), "definition": self.types.definition(name)}
            self._connection.ask(
                Frame(FrameKind.CALL, self._connection.number(), DECLARE, payload=json.dumps(description).encode())
            )
            self._declared.add(name)
        super().publish(topic, message)
