"""Policies behind `POST /act`: OpenVLA's server (openvla@c8f03f4) and its kin."""

import json
import time
from collections.abc import Mapping
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from typing import Unpack
from urllib.parse import urlsplit

from cellwright.clients.policies.actions import extras
from cellwright.clients.policies.codec import pack_json, unpack_json
from cellwright.clients.policies.dialects import ACT_DIALECTS
from cellwright.clients.policies.policy import PolicyAnswerError, PolicyConnectionError
from cellwright.clients.policies.server_policy import ServerPolicy, ServerSettings
from cellwright.clients.policies.sockets import check_listens, cut_after, host_and_port, late, policy_key
from cellwright.util.errors import one_printable_line

_MAX_REPLY = 16 * 2**20  # [bytes]: actions alone, as text


class ActPolicy(ServerPolicy):
    """A policy that answers `POST /act` with JSON, arrays in the form of json_numpy; a connection for each request.

    Args:
        address: `http://HOST:PORT/act`, or `https://`; without a path it is `/act`.
        settings: as of `ServerPolicy`; the dialect is `act` or `act-encoded`, and the former without one.

    Raises:
        PolicyError: an address that is none, or an unknown dialect.
        PolicyConnectionError: no server listens.
    """

    wire, dialects = "HTTP", ACT_DIALECTS

    def __init__(self, address: str, **settings: Unpack[ServerSettings]) -> None:
        super().__init__(address, **settings)
        parts = urlsplit(address)
        self._class = HTTPSConnection if parts.scheme == "https" else HTTPConnection
        self._host, self._port = host_and_port(address, self._class.default_port)
        self._path = (parts.path if parts.path not in ("", "/") else "/act") + (parts.query and f"?{parts.query}")
        self._encoded = settings.get("dialect") == "act-encoded"
        check_listens(address, self._host, self._port, self.timeout)

    def reset(self, seed: int, sentence: str) -> None:
        """Begin an episode: the server keeps nothing of it."""

    def close(self) -> None:
        """Do nothing: no connection outlives its request."""

    def _request(self, observation: Mapping[str, object]) -> tuple[bytes, bytes]:
        packed = pack_json(observation)
        return packed, json.dumps({"encoded": packed.decode()}).encode() if self._encoded else packed

    def _exchange(self, request: bytes) -> tuple[bytes, float]:
        start = time.monotonic()
        return self._post(request), time.monotonic() - start

    def _reply(self, raw: bytes) -> tuple[object, object, Mapping[str, object]]:
        reply = unpack_json(raw)
        if self._encoded and isinstance(reply, str) and reply != "error":
            reply = unpack_json(reply.encode())
        if isinstance(reply, str):  # OpenVLA's answer to any fault, with status 200
            raise PolicyAnswerError(f"the policy failed: {one_printable_line(reply[:1000])}; see the server's log")
        return reply, reply, extras(reply)

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
