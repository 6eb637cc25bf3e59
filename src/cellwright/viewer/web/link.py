"""The page's way to what is served: it asks, sends commands as any program does, and finds its way back."""

from __future__ import annotations

import json
import os
import threading
from dataclasses import replace
from typing import Any

from cellwright.clients.client.transports.connection import Connection
from cellwright.middleware.messages import from_cdr, service_type, to_cdr, type_of
from cellwright.middleware.wire.frames import Frame, FrameError, Kind
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError
from cellwright.viewer.services.names import PAGE

_REQUEST = "_Request"
_PATIENCE = 10.0  # [s] to wait for a greeting


class AwayError(CellwrightError):
    """Nobody is there to be asked; it may come back."""


class Link:
    """A guest of what is served. It may be used by several threads; each waits for its answer.

    It reaches the other end when it is first used, and again when it is used after the other end was gone.

    Args:
        address: host and port at which the cell or the robot is served.
        node: its name as a guest.
        key: the key of the server there, for its own page; a competition tells nobody else.
    """

    def __init__(self, address: tuple[str, int], *, node: str = "", key: str = "") -> None:
        self.address = address
        self._key = key
        self.node = node or f"{PAGE}{os.getpid()}"
        self.welcome: dict[str, Any] = {}
        """What the other end said of itself when it was reached last: `trial`, `topics`, `services`, `lockstep` …"""
        self._connection: Connection | None = None
        self._lock = threading.RLock()

    @property
    def is_there(self) -> bool:
        """Whether somebody was there when it was last asked."""
        return self._connection is not None

    def connect(self) -> None:
        """Reach the other end, once more where that was done before.

        Raises:
            AwayError: nobody answers.
        """
        with self._lock:
            self.close()
            try:
                self._connection = Connection(
                    self.address,
                    node=self.node,
                    encoding="cdr",
                    on_frame=lambda _frame: None,
                    timeout=_PATIENCE,
                    key=self._key,
                )
            except CellwrightError as error:
                raise AwayError(str(error)) from None
            self.welcome = self._connection.welcome

    def ask(self, service: str, **asked: Any) -> dict[str, Any]:
        """Ask the server itself something (JSON), such as `cellwright/panel`.

        Raises:
            AwayError: nobody is there.
            UnknownNameError: the other end has no such service.
            CellwrightError: it was refused; the text says why.
        """
        answer = self._ask(Frame(Kind.CALL, 0, service, payload=json.dumps(asked).encode()))
        try:
            return answer.json()
        except FrameError as error:
            raise CellwrightError(f"{service}: {error}") from None

    def publish(self, topic: str, message: Any) -> None:
        """Send a message as any program does; it is refused, or acted on where time stands.

        Raises:
            CellwrightError: nobody is there, or it was refused.
        """
        self._ask(Frame(Kind.PUBLISH, 0, topic, type_of(type(message)), payload=to_cdr(message)))

    def call(self, service: str, request: Any) -> Any:
        """Call a service of the bus; the answer.

        Raises:
            CellwrightError: nobody is there, or it was refused.
        """
        name = type_of(type(request)).removesuffix(_REQUEST)
        if not self.is_there:
            self.connect()
        types = {each["name"]: str(each["type"]) for each in self.welcome.get("services", ())}
        if service not in types:
            raise UnknownNameError("service", service, types)
        answer = self._ask(Frame(Kind.CALL, 0, service, name, payload=to_cdr(request)))
        if answer.kind is Kind.DONE:
            raise CellwrightError(f"{service} answers when time has passed, which nobody waits for here")
        return from_cdr(answer.payload, service_type(types[service]).response)

    def close(self) -> None:
        """Hang up."""
        with self._lock:
            if self._connection is not None:
                self._connection.close()
            self._connection = None

    def _ask(self, frame: Frame) -> Frame:
        with self._lock:
            if self._connection is None:
                self.connect()
            assert self._connection is not None
            try:
                return self._connection.ask(replace(frame, number=self._connection.number()))
            except RunEndedError as ended:
                self.close()
                raise AwayError(str(ended) or "the other end is gone") from None
