"""Policies behind OpenPI's websocket, and the servers that speak a dialect of it."""

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Unpack

from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidURI
from websockets.protocol import State
from websockets.sync.client import ClientConnection, connect

from cellwright.clients.policies.actions import extras
from cellwright.clients.policies.array_forms import MAX_BYTES
from cellwright.clients.policies.codec import pack, unpack
from cellwright.clients.policies.dialects import DIALECTS, check_reset, detected_dialect, new_session, reported_error
from cellwright.clients.policies.policy import PolicyAnswerError, PolicyConnectionError, PolicyError
from cellwright.clients.policies.server_policy import ServerPolicy, ServerSettings
from cellwright.clients.policies.sockets import cut_after, late, policy_key, unreachable
from cellwright.util.errors import MessageError, one_printable_line, printable

_MAX_QUEUE = 2  # frames that wait in memory, each of up to 64 MiB
_CLOSE_TIMEOUT = 1.0  # [s]: a server that infers does not answer a close


class OpenpiPolicy(ServerPolicy):
    """A policy behind a websocket: connected when made, and again by `reset` after a loss.

    Compression and keep-alive pings are off: the reference server answers no ping while it infers. Connections go to
    the address itself, through no proxy.

    Args:
        address: `ws://HOST:PORT`, or `wss://`; with a path where the server has one.
        settings: as of `ServerPolicy`; without a dialect it is that of the first frame.

    Attributes:
        metadata: the server's first frame.
        dialect: the server's dialect: as set, or as its first frame shows.

    Raises:
        PolicyError: an address that is none, an unknown dialect, or a key that no header can hold.
        PolicyConnectionError: the server cannot be reached.
        PolicyAnswerError: its first frame is no metadata.
    """

    wire, dialects = "a websocket", DIALECTS

    def __init__(self, address: str, **settings: Unpack[ServerSettings]) -> None:
        super().__init__(address, **settings)
        name = settings.get("dialect")
        self._set = None if name is None else DIALECTS[name]
        self.dialect = self._set or DIALECTS["openpi"]
        self._wanted = self._actions
        self._session = new_session()
        self._seed = 0
        self._connection: ClientConnection | None = None
        self._connect()

    def reset(self, seed: int, sentence: str) -> None:  # noqa: ARG002 - the sentence is in each observation
        """Begin an episode: a new session, and a new connection if the old one was lost; see `Policy.reset`."""
        self._seed, self._session = seed, new_session()
        fields = self.dialect.reset_fields(self._session)
        if fields is None:
            if self._connection is None or self._connection.protocol.state is not State.OPEN:
                self._connect()
            return
        request = pack(fields, self.dialect.arrays)
        try:
            raw, _ = self._ask(request)
        except PolicyConnectionError:  # closed between episodes, as vLLM-Omni does after 30 idle seconds
            self._connect()
            raw, _ = self._ask(request)
        with self._placed():
            reply = raw if isinstance(raw, str) else unpack(raw, self.dialect.arrays)
            check_reset(reported_error(reply) or reply)

    def close(self) -> None:
        """Close the connection."""
        self._drop()

    def _request(self, observation: Mapping[str, object]) -> tuple[bytes, bytes]:
        packed = pack(observation, self.dialect.arrays)
        fields = self.dialect.observation_fields(self._session, self._seed)
        return packed, pack({**observation, **fields}, self.dialect.arrays) if fields else packed

    def _exchange(self, request: bytes) -> tuple[bytes, float]:
        raw, wall = self._ask(request)
        if isinstance(raw, str):
            self._drop()  # the server closes the connection after it
            lines = printable(raw, 4000).strip().splitlines() or ["no reason given"]
            raise PolicyAnswerError(
                "\n".join([f"{self._address}: the policy failed: {lines[-1].strip()}", *lines[:-1]])
            )
        return raw, wall

    def _reply(self, raw: bytes) -> tuple[object, object, Mapping[str, object]]:
        reply = unpack(raw, self.dialect.arrays)
        if problem := reported_error(reply):
            raise PolicyAnswerError(f"the policy failed: {one_printable_line(problem[:1000])}")
        return reply, reply, extras(reply)

    def _connect(self) -> None:
        self._drop()
        headers = {"Authorization": f"Api-Key {key}"} if (key := policy_key()) else {}
        try:
            connection = connect(
                self._address,
                additional_headers=headers,
                compression=None,
                max_size=MAX_BYTES,
                max_queue=_MAX_QUEUE,
                open_timeout=self.timeout,
                close_timeout=_CLOSE_TIMEOUT,
                ping_interval=None,
                proxy=None,
            )
        except TimeoutError:
            raise late(self._address, self.timeout) from None
        except (OSError, EOFError) as error:
            raise unreachable(self._address, error) from None
        except InvalidHandshake as error:
            reason = one_printable_line(str(error)[:300])
            raise PolicyConnectionError(f"{self._address}: no websocket answers there ({reason})") from None
        except (InvalidURI, ValueError) as error:  # a refused certificate is a ValueError too, and an OSError
            raise PolicyError(f"{self._address}: no address of a websocket ({error}); write ws://HOST:PORT") from None
        self._connection = connection
        first = self._receive(connection, self.timeout)
        if isinstance(first, str):
            self._drop()
            raise PolicyAnswerError(
                f"{self._address}: the first frame must be metadata (got the text {one_printable_line(first[:300])!r})"
            )
        self._read_metadata(first)

    def _read_metadata(self, first: bytes) -> None:
        problem, metadata = "", None
        for dialect in [self._set] if self._set else [DIALECTS["openpi"], DIALECTS["lebedov"]]:
            try:
                metadata = unpack(first, dialect.arrays)
            except MessageError as error:
                problem = problem or str(error)
            else:
                self.dialect = dialect
                problem = reported_error(metadata) or ""
                break
        if problem or not isinstance(metadata, dict):
            self._drop()
            got = one_printable_line((problem or type(metadata).__name__)[:300])
            raise PolicyAnswerError(f"{self._address}: the first frame must be a map of metadata (got {got})")
        if self._set is None and self.dialect.name == "openpi":
            self.dialect = detected_dialect(metadata)
        self.metadata = metadata
        keys = metadata.get("action_keys")
        if not self._wanted.keys and isinstance(keys, list) and all(isinstance(each, str) for each in keys):
            self._actions = replace(self._wanted, keys=tuple(keys))

    def _ask(self, request: bytes) -> tuple[bytes | str, float]:
        """Send a request and return the reply with the time between [s]; a connection that fails is dropped."""
        connection = self._connection
        if connection is None:
            raise PolicyConnectionError(f"{self._address}: the connection is lost; the next episode makes another")
        stray = self._waiting(connection)
        if stray:
            self._drop()
            raise PolicyAnswerError(f"{self._address}: the server sent a frame that no request asked for")
        start = time.monotonic()
        try:
            with cut_after(self.timeout, lambda: connection.socket):
                connection.send(request)
        except (ConnectionClosed, OSError) as error:
            self._drop()
            if time.monotonic() - start >= self.timeout:
                raise late(self._address, self.timeout) from None
            raise self._lost(error) from None
        raw = self._receive(connection, self.timeout - (time.monotonic() - start))
        return raw, time.monotonic() - start

    def _waiting(self, connection: ClientConnection) -> bool:
        """Return whether a frame waits: every answer after it would be that of the request before."""
        try:
            connection.recv(timeout=0)
        except TimeoutError:
            return False
        except (ConnectionClosed, OSError) as error:
            self._drop()
            raise self._lost(error) from None
        return True

    def _receive(self, connection: ClientConnection, timeout: float) -> bytes | str:
        try:
            return connection.recv(timeout=max(timeout, 0.0))
        except TimeoutError:
            self._drop()  # its late answer would be taken for that of the next request
            raise late(self._address, self.timeout) from None
        except (ConnectionClosed, OSError) as error:
            self._drop()
            raise self._lost(error) from None

    def _lost(self, error: Exception) -> PolicyConnectionError:
        return PolicyConnectionError(f"{self._address}: the connection is lost ({_reason(error)})")

    def _drop(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            with suppress(OSError, ConnectionClosed):
                connection.close()


def _reason(error: Exception) -> str:
    """Return why a connection ended, with the peer's close code and reason if it sent them."""
    if not isinstance(error, ConnectionClosed):
        return one_printable_line(str(error)[:300])
    if error.sent is not None and error.sent.code == 1009:
        return f"a message of it is larger than {MAX_BYTES // 2**20} MiB"
    if error.rcvd is None:
        return "without a word"
    return one_printable_line(f"the server closed it: {error.rcvd.code} {error.rcvd.reason}".strip()[:300])
