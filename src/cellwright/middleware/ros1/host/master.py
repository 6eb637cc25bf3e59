"""The ROS master, spoken to from this process in XML-RPC. No call lasts longer than it may."""

from __future__ import annotations

import http.client
import socket
import threading
import xmlrpc.client
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlsplit

from cellwright.util.errors import CellwrightError, UsageError

URI_VARIABLE = "ROS_MASTER_URI"
DEFAULT_URI = "http://localhost:11311"

PATIENCE = 3.0
"""How long [s] a call may last in all."""

_CALLER = "/cellwright"


class MasterError(CellwrightError):
    """The master gave no answer, or not the one that it should; the text says which."""


class _Transport(xmlrpc.client.Transport):
    """XML-RPC over a connection on which no single read or write lasts long."""

    def __init__(self, patience: float) -> None:
        super().__init__()
        self._patience = patience

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._patience
        return connection


class Master:
    """A ROS master, which may be there or not.

    Args:
        uri: its address, as ROS_MASTER_URI has it.
        patience: how long [s] a call may last.

    Raises:
        UsageError: this is no address.
    """

    def __init__(self, uri: str, patience: float = PATIENCE) -> None:
        self.uri = uri.rstrip("/")
        self._patience = patience
        try:
            parts = urlsplit(self.uri)
            self.host, self.port = parts.hostname or "", parts.port or 0
        except ValueError:
            parts, self.host, self.port = urlsplit(""), "", 0
        if parts.scheme != "http" or not self.host or not self.port:
            raise UsageError(f"{URI_VARIABLE} is {uri!r}, which is no address like {DEFAULT_URI}")

    @property
    def is_local(self) -> bool:
        """Whether the address is one of this machine: a master that is missing there can be started."""
        if self.host in ("localhost", "127.0.0.1", "::1"):
            return True
        names = {socket.gethostname(), socket.gethostname().partition(".")[0]}
        return self.host in names or self.host.startswith("127.")

    def answers(self) -> bool:
        """Whether there is a master."""
        try:
            self._call(self.uri, "getPid")
        except MasterError:
            return False
        return True

    def is_port_taken(self) -> bool:
        """Whether something listens at the address, be it a master or not."""
        try:
            socket.create_connection((self.host, self.port), timeout=self._patience).close()
        except OSError:
            return False
        return True

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter, or with a dictionary all that lie under a name.

        Raises:
            MasterError: it could not be set.
        """
        self._call(self.uri, "setParam", name, value)

    def parameter(self, name: str) -> Any | None:
        """The value of a parameter; None if nobody has set it.

        Raises:
            MasterError: the master does not answer.
        """
        code, _, value = self._answer(self.uri, "getParam", name)
        return value if code == 1 else None

    def set_parameters(self, parameters: Mapping[str, Any]) -> None:
        """Set many parameters, nested in dictionaries by their names.

        What others have beside them stays, down to the second level: `/gazebo` is not ours alone, `/ariac/arm` is.

        Raises:
            MasterError: one of them could not be set.
        """
        for name, value in parameters.items():
            if isinstance(value, Mapping):
                for below, each in value.items():
                    self.set_parameter(f"/{name}/{below}", each)
            else:
                self.set_parameter(f"/{name}", value)

    def living_node(self, name: str) -> str | None:
        """The address of a node that is registered and answers; None if there is none.

        Raises:
            MasterError: the master does not answer.
        """
        code, _, uri = self._answer(self.uri, "lookupNode", name)
        if code != 1:
            return None
        try:
            self._call(uri, "getPid")
        except MasterError:
            return None
        return str(uri)

    def living_publishers(self, topic: str) -> list[str]:
        """The nodes that publish a topic and answer.

        Raises:
            MasterError: the master does not answer.
        """
        published, _, _ = self._call(self.uri, "getSystemState")
        nodes: list[Any] = next((nodes for name, nodes in published if name == topic), [])
        return [node for node in map(str, nodes) if self.living_node(node) is not None]

    # ---------------------------------------------------------------- calls

    def _call(self, uri: str, method: str, *arguments: Any) -> Any:
        code, text, value = self._answer(uri, method, *arguments)
        if code != 1:
            raise MasterError(f"{method}: {text}")
        return value

    def _answer(self, uri: str, method: str, *arguments: Any) -> tuple[int, str, Any]:
        """Code, text and value of an answer. A thread waits for it: a name can take minutes to look up."""
        found: list[Any] = []

        def ask() -> None:
            try:
                with xmlrpc.client.ServerProxy(uri, _Transport(self._patience)) as proxy:
                    code, text, value = getattr(proxy, method)(_CALLER, *arguments)
                    found.append((int(code), str(text), value))
            except Exception as error:  # the library raises all kinds of them when nonsense comes
                found.append(MasterError(f"{uri} gave no answer: {error}"))

        thread = threading.Thread(target=ask, name="ros-master", daemon=True)
        thread.start()
        thread.join(self._patience)
        if not found:
            raise MasterError(f"{uri} gave no answer in {self._patience:g} s")
        if isinstance(found[0], MasterError):
            raise found[0]
        answer: tuple[int, str, Any] = found[0]
        return answer
