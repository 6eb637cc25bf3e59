"""ROS master: XML-RPC client with a timeout, and an own master if there is none.

Master and rosout are started separately, not by `roscore`, which would leave them behind if it were killed.
"""

from __future__ import annotations

import http.client
import socket
import threading
import time
import uuid
import xmlrpc.client
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import urlsplit

from cellwright.middleware.child import Child, RestartDelay, Waiting, describe_exit
from cellwright.middleware.ros1.host.installation import HOW_TO_GET_IT, Installation
from cellwright.util.errors import CellwrightError, UsageError

URI_VARIABLE = "ROS_MASTER_URI"
DEFAULT_URI = "http://localhost:11311"
CALL_TIMEOUT = 3.0  # timeout of a whole call [s]
_CALLER = "/cellwright"
_NAP = 0.02


class MasterError(CellwrightError):
    """The master gave no answer, or an unexpected one; the text says which."""


class _TimeoutTransport(xmlrpc.client.Transport):
    """XML-RPC transport with a timeout of each read and write."""

    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


class MasterClient:
    """Client of a ROS master, which may or may not run.

    Unless documented otherwise, all calls raise a MasterError if it does not answer, or refuses.

    Raises:
        UsageError: the address is not of the form of ROS_MASTER_URI.
    """

    def __init__(self, uri: str, timeout: float = CALL_TIMEOUT) -> None:
        self.uri = uri.rstrip("/")
        self._timeout = timeout
        try:
            parts = urlsplit(self.uri)
            self.host, self.port = parts.hostname or "", parts.port or 0
        except ValueError:
            parts, self.host, self.port = urlsplit(""), "", 0
        if parts.scheme != "http" or not self.host or not self.port:
            raise UsageError(f"{URI_VARIABLE} is {uri!r}, not an address like {DEFAULT_URI}")

    @property
    def is_local(self) -> bool:
        """True if the address is one of this machine, where a missing master can be started."""
        if self.host in ("localhost", "127.0.0.1", "::1"):
            return True
        names = {socket.gethostname(), socket.gethostname().partition(".")[0]}
        return self.host in names or self.host.startswith("127.")

    def answers(self) -> bool:
        """Return whether the master answers."""
        try:
            self._call(self.uri, "getPid")
        except MasterError:
            return False
        return True

    def is_port_taken(self) -> bool:
        """Return whether something listens at the address, a master or not."""
        try:
            socket.create_connection((self.host, self.port), timeout=self._timeout).close()
        except OSError:
            return False
        return True

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter, or with a dictionary all parameters under a name."""
        self._call(self.uri, "setParam", name, value)

    def parameter(self, name: str) -> Any | None:
        """Return the value of a parameter; None if it is not set."""
        code, _, value = self._answer(self.uri, "getParam", name)
        return value if code == 1 else None

    def set_parameters(self, parameters: Mapping[str, Any]) -> None:
        """Set many parameters, nested in dictionaries by their names.

        Other parameters beside them stay, down to the second level: a node's own may have some of other programs.
        """
        for name, value in parameters.items():
            if isinstance(value, Mapping):
                for below, each in value.items():
                    self.set_parameter(f"/{name}/{below}", each)
            else:
                self.set_parameter(f"/{name}", value)

    def living_node(self, name: str) -> str | None:
        """Return the address of a node that is registered and answers; None if there is none."""
        code, _, uri = self._answer(self.uri, "lookupNode", name)
        if code != 1:
            return None
        try:
            self._call(uri, "getPid")
        except MasterError:
            return None
        return str(uri)

    def living_publishers(self, topic: str) -> list[str]:
        """Return the nodes that publish a topic and answer."""
        published, _, _ = self._call(self.uri, "getSystemState")
        nodes: list[Any] = next((nodes for name, nodes in published if name == topic), [])
        return [node for node in map(str, nodes) if self.living_node(node) is not None]

    def _call(self, uri: str, method: str, *arguments: Any) -> Any:
        code, text, value = self._answer(uri, method, *arguments)
        if code != 1:
            raise MasterError(f"{method}: {text}")
        return value

    def _answer(self, uri: str, method: str, *arguments: Any) -> tuple[int, str, Any]:
        """Return code, text and value of an answer. A thread waits for it: a name can take minutes to resolve."""
        found: list[Any] = []

        def ask() -> None:
            try:
                with xmlrpc.client.ServerProxy(uri, _TimeoutTransport(self._timeout)) as proxy:
                    code, text, value = getattr(proxy, method)(_CALLER, *arguments)
                    found.append((int(code), str(text), value))
            except Exception as error:  # the library raises all kinds of errors for invalid answers
                found.append(MasterError(f"{uri} gave no answer: {error}"))

        thread = threading.Thread(target=ask, name="ros-master", daemon=True)
        thread.start()
        thread.join(self._timeout)
        if not found:
            raise MasterError(f"{uri} gave no answer in {self._timeout:g} s")
        if isinstance(found[0], MasterError):
            raise found[0]
        answer: tuple[int, str, Any] = found[0]
        return answer


class OwnMaster:
    """Supervisor of an own master, which it starts again when it ends; `report` takes lines about that.

    Raises:
        UsageError: rosmaster is not installed, or something else listens at the address.
    """

    def __init__(self, installation: Installation, master: MasterClient, report: Callable[[str], None]) -> None:
        program = installation.program("rosmaster")
        if program is None:
            raise UsageError(f"no ROS master answers at {master.uri}, and rosmaster is not installed; {HOW_TO_GET_IT}")
        if master.is_port_taken():
            raise UsageError(f"the program at {master.uri} is not a ROS master; set ROS_MASTER_URI to another port")
        self._installation = installation
        self._master = master
        self._report = report
        self._program = program
        self._timeout = RestartDelay()
        self._again = 0.0
        self._is_left_to_others = False
        self._last_line = ""
        self._rosout: Child | None = None
        self._rosout_patience = RestartDelay()
        self._rosout_again: float | None = None
        self._child: Child | None = self._start()

    def wait(self, is_stopped: Callable[[], bool]) -> None:
        """Wait until it answers, or `is_stopped`.

        Raises:
            UsageError: it ended, or did not answer in time.
        """
        waiting = Waiting(f"the ROS master that was started at {self._master.uri}", self._report)
        while not self._master.answers():
            if is_stopped():
                return
            status = None if self._child is None else self._child.poll()
            if status is not None or waiting.is_over():
                how = "does not answer" if status is None else describe_exit(status)
                raise UsageError(f"the ROS master that was started at {self._master.uri} {how}: {self._last_line}")
            time.sleep(_NAP)
        self._start_rosout()

    def mark(self) -> None:
        """Set the id of the run, as `roslaunch` expects of a master."""
        self._master.set_parameter("/run_id", str(uuid.uuid1()))

    def poll(self) -> None:
        """Check the processes, and restart those that ended; call it often."""
        if self._child is not None:
            status = self._child.poll()
            if status is None:
                self._look_after_rosout()
            else:
                wait = self._timeout.after(time.monotonic() - self._child.started)
                self._report(f"the ROS master at {self._master.uri} {describe_exit(status)}; restarting it")
                self._stop_children()
                self._again = time.monotonic() + wait
        elif time.monotonic() >= self._again and not self._is_left_to_others:
            if self._master.is_port_taken():
                self._is_left_to_others = True
                self._report(f"another program listens at {self._master.uri} now; no new master is started")
            else:
                self._again = time.monotonic() + self._timeout.after(0.0)
                self._child = self._start()
                self._start_rosout()

    def stop(self) -> None:
        """End master and rosout."""
        self._stop_children()

    def _start(self) -> Child:
        return self._run([self._program, "--core", "-p", str(self._master.port)])

    def _start_rosout(self) -> None:
        """Start the node that collects logs; it waits for the master."""
        if rosout := self._installation.node("rosout", "rosout"):
            self._rosout = self._run([rosout])

    def _look_after_rosout(self) -> None:
        """Restart rosout if it alone has ended; without it only the logs of programs are lost."""
        if self._rosout is not None and (status := self._rosout.poll()) is not None:
            self._rosout_again = time.monotonic() + self._rosout_patience.after(time.monotonic() - self._rosout.started)
            self._report(f"the node /rosout {describe_exit(status)}; restarting it")
            self._rosout = None
        elif self._rosout is None and self._rosout_again is not None and time.monotonic() >= self._rosout_again:
            self._rosout_again = None
            self._start_rosout()

    def _run(self, command: list[str]) -> Child:
        return Child(command, self._installation.environment, python=self._installation.python, on_error=self._on_line)

    def _on_line(self, line: str) -> None:
        self._last_line = line

    def _stop_children(self) -> None:
        for child in (self._rosout, self._child):
            if child is not None:
                child.stop()
        self._rosout = self._child = None
        self._rosout_again = None
