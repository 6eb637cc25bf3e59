"""Policies behind servers: settings, and the way from an observation to an answer, whatever the wire."""

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import ClassVar, TypedDict

from cellwright.clients.policies.actions import ActionFormat, server_time
from cellwright.clients.policies.policy import Answer, PolicyAnswerError, PolicyError
from cellwright.clients.policies.sockets import TIMEOUT
from cellwright.util.errors import MessageError, did_you_mean


class ServerSettings(TypedDict, total=False):
    """Settings of a policy behind a server, each with its default in `ServerPolicy`."""

    dialect: str | None
    timeout: float
    actions: ActionFormat


class ServerPolicy(ABC):
    """A policy behind a server.

    Args:
        address: address of the server.
        dialect: name of the server's dialect; None for the usual one, or to tell it from the server's first words.
        timeout: bound of an answer [s].
        actions: form that the actions of an answer must have.

    Attributes:
        wire: name of the wire, for errors.
        dialects: names of its dialects.
        timeout: bound of an answer [s].
        metadata: facts that the server states; empty if none.

    Raises:
        PolicyError: an unknown dialect. Each wire refuses, beside that, an address that is none.
    """

    wire: ClassVar[str]
    dialects: ClassVar[Iterable[str]]

    def __init__(
        self,
        address: str,
        *,
        dialect: str | None = None,
        timeout: float = TIMEOUT,
        actions: ActionFormat = ActionFormat(),  # noqa: B008 - frozen
    ) -> None:
        if dialect is not None and dialect not in self.dialects:
            known = f"{did_you_mean(dialect, self.dialects)} (known for {self.wire}: {', '.join(self.dialects)})"
            raise PolicyError(f"dialect: unknown {dialect!r}{known}")
        self.metadata: Mapping[str, object] = {}
        self.timeout = timeout
        self._address, self._actions = address, actions

    def infer(self, observation: Mapping[str, object]) -> Answer:
        """Send an observation and return the answer; see `Policy.infer`."""
        try:
            packed, request = self._request(observation)
        except MessageError as error:
            raise PolicyError(f"observation: {error}") from None
        raw, wall = self._exchange(request)
        with self._placed():
            reply, timed, extras = self._reply(raw)
            actions = self._actions.read(reply)
        return Answer(actions, raw, hashlib.sha256(packed).hexdigest(), wall, server_time(timed), extras)

    @abstractmethod
    def reset(self, seed: int, sentence: str) -> None:
        """Begin an episode; see `Policy.reset`."""

    @abstractmethod
    def close(self) -> None:
        """Release everything; a second call does nothing."""

    @abstractmethod
    def _request(self, observation: Mapping[str, object]) -> tuple[bytes, bytes]:
        """Return the bytes of an observation, and those of the request that has it."""

    @abstractmethod
    def _exchange(self, request: bytes) -> tuple[bytes, float]:
        """Send a request, and return the reply with the time between [s]."""

    @abstractmethod
    def _reply(self, raw: bytes) -> tuple[object, object, Mapping[str, object]]:
        """Return the actions of a reply, its part that has the server's times, and its further entries."""

    @contextmanager
    def _placed(self) -> Iterator[None]:
        """Name the server in errors about its answer."""
        try:
            yield
        except (MessageError, PolicyAnswerError) as error:
            raise PolicyAnswerError(f"{self._address}: {error}") from None
