"""The ROS master: whether it is there, whether it knows us, and what becomes of us when it goes."""

from __future__ import annotations

import http.client
import os
import threading
import time
import xmlrpc.client
from typing import Any, Callable
from urllib.parse import urlparse

import rosgraph

from cellwright.middleware.ros1.bridge.loop import report

TIMEOUT = 2.0  # how long the master may take to answer [s]
PERIOD = 1.0  # how often it is looked after [s]
_LOOPBACK = ("localhost", "::1")
_RETRY = 0.25


class MasterGoneError(Exception):
    """The master does not answer; the text says where."""


class Master:
    """The master that the environment names, with a limit to how long it may take."""

    def __init__(self, node: str) -> None:
        self.uri: str = rosgraph.get_master_uri()
        self._node = node
        self._server = xmlrpc.client.ServerProxy(self.uri, transport=_Transport())

    def ask(self, method: str, *arguments: Any) -> Any | None:
        """Call a method of the master's API; its value, None when it says that it cannot.

        Raises:
            MasterGoneError: it does not answer.
        """
        try:
            code, _, value = getattr(self._server, method)(self._node, *arguments)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error, ValueError, TypeError) as error:
            raise MasterGoneError(f"no ROS master answers at {self.uri}: {error}") from None
        return value if code == 1 else None

    def wait(self, patience: float) -> None:
        """Wait until it answers.

        Raises:
            MasterGoneError: it has not in this time [s].
        """
        end = time.monotonic() + patience
        while True:
            try:
                self.ask("getPid")
                return
            except MasterGoneError:
                if time.monotonic() > end:
                    raise
            time.sleep(_RETRY)

    def knows(self, node: str, *, publishes: str, hears: str) -> bool:
        """Whether a node is known to publish one topic and to subscribe to another.

        Raises:
            MasterGoneError: the master does not answer.
        """
        state = self.ask("getSystemState")
        if state is None:
            return False
        publishers, subscribers = dict(state[0]), dict(state[1])
        return node in publishers.get(publishes, ()) and node in subscribers.get(hears, ())


class MasterWatch:
    """Looks after the master in a thread of its own.

    Args:
        node: our node name.
        uri: our address, as the master should know it.
        on_new: called when there is a master that does not know us.
        on_replaced: called when another node has our name.
    """

    def __init__(self, node: str, uri: str, on_new: Callable[[], None], on_replaced: Callable[[], None]) -> None:
        self._master = Master(node)
        self._node = node
        self._uri = uri
        self._on_new = on_new
        self._on_replaced = on_replaced
        threading.Thread(target=self._watch, name="master", daemon=True).start()

    def _watch(self) -> None:
        is_lost, failures = False, 0
        while True:
            time.sleep(_RETRY if failures else PERIOD)
            try:
                known = self._master.ask("lookupNode", self._node)
            except MasterGoneError:
                failures += 1
                if failures > 1 and not is_lost:
                    is_lost = True
                    report(
                        f"the ROS master at {self._master.uri} is gone, and with it all parameters: programs that "
                        "start now find no topic and no service; connections that stand go on, and so does "
                        f"{self._node}"
                    )
                continue
            if known is None:
                report(f"a new ROS master answers at {self._master.uri}: registering everything there")
                self._on_new()
                return
            if known.rstrip("/") != self._uri.rstrip("/"):
                self._on_replaced()
                return
            if is_lost:
                report(f"the ROS master at {self._master.uri} answers again, and has forgotten nothing")
            is_lost, failures = False, 0


def listen_on_loopback() -> None:
    """Have the node listen on loopback only when the master does and nothing else was said."""
    environment = os.environ
    if any(environment.get(name) for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_IPV6")):
        return
    host = urlparse(rosgraph.get_master_uri()).hostname or ""
    if host in _LOOPBACK or host.startswith("127."):
        environment["ROS_IP"] = "127.0.0.1"


class _Transport(xmlrpc.client.Transport):
    """XML-RPC with a limit to how long an answer may take."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = TIMEOUT
        return connection
