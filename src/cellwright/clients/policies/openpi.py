"""Policies behind OpenPI's websocket, and the servers that speak a dialect of it."""

import hashlib
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace

from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidURI
from websockets.protocol import State
from websockets.sync.client import ClientConnection, connect

from cellwright.clients.policies.actions import ActionFormat, extras, server_time
from cellwright.clients.policies.array_forms import MAX_BYTES
from cellwright.clients.policies.codec import pack, unpack
from cellwright.clients.policies.dialects import (
    DIALECTS,
    check_reset,
    detected_dialect,
    named_dialect,
    new_session,
    reported_error,
)
from cellwright.clients.policies.policy import Answer, PolicyAnswerError, PolicyConnectionError, PolicyError
from cellwright.clients.policies.sockets import TIMEOUT, cut_after, late, policy_key, unreachable
from cellwright.util.errors import MessageError, one_printable_line, printable

_MAX_QUEUE = 2  # frames that wait in memory, each of up to 64 MiB
_CLOSE_TIMEOUT = 1.0  # [s]: a server that infers does not answer a close


class OpenpiPolicy:
    """A policy behind a websocket: connected when made, and again by `reset` after a loss.

    Compression and keep-alive pings are off: the reference server answers no ping while it infers. Connections go to
    the address itself, through no proxy.

    Args:
        address: `ws://HOST:PORT`, or `wss://`; with a path where the server has one.
        dialect: name of the server's dialect; None to tell it from the first frame.
        timeout: how long the handshake or an answer may take [s].
        actions: what an answer must have.

    Attributes:
        timeout: how long an answer may take [s].
        metadata: the server's first frame.
        dialect: the server's dialect: as set, or as its first frame shows.

    Raises:
        PolicyError: an address that is none, an unknown dialect, or a key that no header can hold.
        PolicyConnectionError: the server cannot be reached.
        PolicyAnswerError: its first frame is no metadata.
    """

    def __init__(
        self,
        address: str,
        *,
        dialect: str | None = None,
        timeout: float = TIMEOUT,
        actions: ActionFormat = ActionFormat(),  # noqa: B008 - frozen
    ) -> None:
        self.metadata: Mapping[str, object] = {}
        self._address = address
        self._set = None if dialect is None else named_dialect(dialect)
        self.dialect = self._set or DIALECTS["openpi"]
        self.timeout = timeout
        self._wanted = self._actions = actions
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
            raw, _ = self._exchange(request)
        except PolicyConnectionError:  # closed between episodes, as vLLM-Omni does after 30 idle seconds
            self._connect()
            raw, _ = self._exchange(request)
        reply = raw if isinstance(raw, str) else self._unpacked(raw)
        with self._placed():
            check_reset(reported_error(reply) or reply)

    def infer(self, observation: Mapping[str, object]) -> Answer:
        """Send an observation and return the answer; see `Policy.infer`."""
        dialect = self.dialect
        try:
            packed = pack(observation, dialect.arrays)
            fields = dialect.observation_fields(self._session, self._seed)
            request = pack({**observation, **fields}, dialect.arrays) if fields else packed
        except MessageError as error:
            raise PolicyError(f"observation: {error}") from None
        raw, wall = self._exchange(request)
        if isinstance(raw, str):
            self._drop()  # the server closes the connection after it
            lines = printable(raw, 4000).strip().splitlines() or ["no reason given"]
            raise PolicyAnswerError(
                "\n".join([f"{self._address}: the policy failed: {lines[-1].strip()}", *lines[:-1]])
            )
        reply = self._unpacked(raw)
        with self._placed():
            if problem := reported_error(reply):
                raise PolicyAnswerError(f"the policy failed: {one_printable_line(problem[:1000])}")
            actions = self._actions.read(reply)
        digest = hashlib.sha256(packed).hexdigest()
        return Answer(actions, raw, digest, wall, server_time(reply), extras(reply))

    def close(self) -> None:
        """Close the connection."""
        self._drop()

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

    def _exchange(self, request: bytes) -> tuple[bytes | str, float]:
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

    def _unpacked(self, raw: bytes) -> object:
        with self._placed():
            return unpack(raw, self.dialect.arrays)

    @contextmanager
    def _placed(self) -> Iterator[None]:
        """Name the server in errors about its answer."""
        try:
            yield
        except (MessageError, PolicyAnswerError) as error:
            raise PolicyAnswerError(f"{self._address}: {error}") from None

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
