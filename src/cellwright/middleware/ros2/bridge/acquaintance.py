"""Proof that nodes know a publisher of this process: a best-effort subscriber misses its messages before that.

DDS announces the endpoints of a process reliably, and in order. So a node that answers a client made after the
publisher knows the publisher. Nearly every node has the services of its parameters, which change nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

SERVICE, SERVICE_TYPE = "get_parameters", "rcl_interfaces/GetParameters"
"""Service of each node that is called, and its type."""
UNPROVEN = 0.3
"""Time [s] after which a node without the service is expected to know the publisher."""
PATIENCE = 2.0
"""Time [s] after which a node that does not answer is not awaited any more: it may be busy for long."""
_AGAIN = 0.2  # [s]: a request of a client that the node does not know yet is lost


class Acquaintance:
    """Acquaintance of some nodes with the publishers made before.

    Args:
        clients: clients of the nodes' services, made after the publishers.
        request: request without effect.
        destroy: destroys a client.
        clock: time [s].
    """

    def __init__(
        self,
        clients: Sequence[Any],
        request: Any,
        destroy: Callable[[Any], object],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._open = list(clients)
        self._request = request
        self._destroy = destroy
        self._clock = clock
        self._begin = clock()
        self._asked = -PATIENCE
        self._answers: list[tuple[Any, Any]] = []

    def is_made(self) -> bool:
        """Return whether the nodes know the publishers, False at most for `PATIENCE`; it asks them again and again."""
        passed = self._clock() - self._begin
        for client, answer in self._answers:
            if client in self._open and answer.done():
                self._leave(client)
        if passed >= PATIENCE:
            for client in list(self._open):
                self._leave(client)
        elif passed >= self._asked + _AGAIN:
            self._asked = passed
            ready = [client for client in self._open if client.service_is_ready()]
            self._answers += [(client, client.call_async(self._request)) for client in ready]
        return not self._open

    def _leave(self, client: Any) -> None:
        self._open.remove(client)
        self._destroy(client)
