"""Policies behind `POST /act`: OpenVLA's server (openvla@c8f03f4) and its kin."""

import hashlib
import json
import time
from collections.abc import Mapping
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from types import MappingProxyType
from urllib.parse import urlsplit

from cellwright.clients.policies.actions import ActionFormat, extras, server_time
from cellwright.clients.policies.codec import pack_json, unpack_json
from cellwright.clients.policies.dialects import ACT_DIALECTS
from cellwright.clients.policies.policy import Answer, PolicyAnswerError, PolicyConnectionError, PolicyError
from cellwright.clients.policies.sockets import TIMEOUT, check_listens, cut_after, host_and_port, late, policy_key
from cellwright.util.errors import MessageError, did_you_mean, one_printable_line

_MAX_REPLY = 16 * 2**20  # [bytes]: actions alone, as text


class ActPolicy:
    """A policy that answers `POST /act` with JSON, arrays in the form of json_numpy; a connection for each request.

    Args:
        address: `http://HOST:PORT/act`, or `https://`; without a path it is `/act`.
        dialect: `act` or `act-encoded`; None for the former.
        timeout: how long an answer may take [s].
        actions: what an answer must have.

    Attributes:
        timeout: how long an answer may take [s].
        metadata: empty: the server has none.

    Raises:
        PolicyError: an address that is none, or an unknown dialect.
        PolicyConnectionError: no server listens.
    """

    def __init__(
        self,
        address: str,
        *,
        dialect: str | None = None,
        timeout: float = TIMEOUT,
        actions: ActionFormat = ActionFormat(),  # noqa: B008 - frozen
    ) -> None:
        if dialect not in (None, *ACT_DIALECTS):
            known = f"{did_you_mean(dialect, ACT_DIALECTS)} (known for HTTP: {', '.join(ACT_DIALECTS)})"
            raise PolicyError(f"dialect: unknown {dialect!r}{known}")
        self.metadata: Mapping[str, object] = MappingProxyType({})
        parts = urlsplit(address)
        self._address, self.timeout, self._actions = address, timeout, actions
        self._class = HTTPSConnection if parts.scheme == "https" else HTTPConnection
        self._host, self._port = host_and_port(address, self._class.default_port)
        self._path = (parts.path if parts.path not in ("", "/") else "/act") + (parts.query and f"?{parts.query}")
        self._encoded = dialect == "act-encoded"
        check_listens(address, self._host, self._port, timeout)

    def reset(self, seed: int, sentence: str) -> None:
        """Begin an episode: the server keeps nothing of it."""

    def infer(self, observation: Mapping[str, object]) -> Answer:
        """Post an observation and return the answer; see `Policy.infer`."""
        try:
            packed = pack_json(observation)
        except MessageError as error:
            raise PolicyError(f"observation: {error}") from None
        start = time.monotonic()
        raw = self._post(json.dumps({"encoded": packed.decode()}).encode() if self._encoded else packed)
        wall = time.monotonic() - start
        try:
            reply = unpack_json(raw)
            if self._encoded and isinstance(reply, str) and reply != "error":
                reply = unpack_json(reply.encode())
            if isinstance(reply, str):  # OpenVLA's answer to any fault, with status 200
                raise PolicyAnswerError(f"the policy failed: {one_printable_line(reply[:1000])}; see the server's log")
            actions = self._actions.read(reply)
        except (MessageError, PolicyAnswerError) as error:
            raise PolicyAnswerError(f"{self._address}: {error}") from None
        return Answer(actions, raw, hashlib.sha256(packed).hexdigest(), wall, server_time(reply), extras(reply))

    def close(self) -> None:
        """Do nothing: no connection outlives its request."""

    def _post(self, body: bytes) -> bytes:
        """Return the body of the answer to a request."""
        connection = self._class(self._host, self._port, timeout=self.timeout)
        headers = {"Content-Type": "application/json"}
        if key := policy_key():
            headers["Authorization"] = f"Api-Key {key}"
        start = time.monotonic()
        try:
            with cut_after(self.timeout, lambda: connection.sock):
                connection.request("POST", self._path, body, headers)
                response = connection.getresponse()
                content = response.read(_MAX_REPLY + 1)
        except (OSError, HTTPException, ValueError) as error:
            if time.monotonic() - start >= self.timeout:
                raise late(self._address, self.timeout) from None
            reason = one_printable_line(f"{type(error).__name__}: {error}"[:300])
            raise PolicyConnectionError(f"{self._address}: the request failed ({reason})") from None
        finally:
            connection.close()
        if time.monotonic() - start >= self.timeout:  # a body that was cut looks like its end
            raise late(self._address, self.timeout)
        if len(content) > _MAX_REPLY:
            raise PolicyAnswerError(f"{self._address}: an answer has at most {_MAX_REPLY // 2**20} MiB")
        if response.length:  # fewer bytes than announced
            raise PolicyConnectionError(f"{self._address}: the request failed (the connection broke within the answer)")
        if response.status != 200:
            said = one_printable_line(content[:300].decode(errors="replace"))
            raise PolicyAnswerError(f"{self._address}: HTTP {response.status} {response.reason}: {said}")
        return content
