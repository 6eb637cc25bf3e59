"""Policies of GR00T's servers, over ZeroMQ (Isaac-GR00T@38624df)."""

import time
from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
import zmq

from cellwright.clients.policies.array_forms import MAX_BYTES, NPY
from cellwright.clients.policies.codec import pack, unpack
from cellwright.clients.policies.dialects import GROOT_DIALECTS, GROOT_MODALITIES
from cellwright.clients.policies.policy import PolicyAnswerError, PolicyConnectionError, PolicyError
from cellwright.clients.policies.server_policy import ServerPolicy, ServerSettings
from cellwright.clients.policies.sockets import check_listens, host_and_port, late, policy_key
from cellwright.util.errors import MessageError, one_printable_line

_PORT = 5555
MAX_HISTORY = 600
"""Most control periods that a policy may look back."""
MAX_FRAMES = 16
"""Most observations that a policy may want at once."""


class GrootPolicy(ServerPolicy):
    """A policy of GR00T: asked for its modalities when made, and for actions one observation at a time.

    An observation has pictures as `video.NAME` (H, W, 3) uint8, numbers as `state.NAME` (D,), and text as
    `language.NAME`; or the same in mappings `video`, `state` and `language`. The axes of batch and time are added here.

    A policy may want earlier observations too, such as `delta_indices` of `[-15, 0]`, counted in control periods. They
    are those that were given to `see` and `infer` since the episode began; before the first one, that is repeated.

    Args:
        address: `tcp://HOST:PORT`; the port is 5555 if it is left out.
        settings: as of `ServerPolicy`; the dialect is `groot` or `groot-sim`, and the former without one. Without keys
            the actions are those of the policy's modality `action`.

    Attributes:
        metadata: the modalities, each with its `modality_keys` and `delta_indices`.
        history: number of control periods that it looks back; if any, `see` wants each observation without a request.

    Raises:
        PolicyError: an address that is none, or an unknown dialect.
        PolicyConnectionError: no server listens, or answers in time.
        PolicyAnswerError: it is no server of GR00T, or its policy wants observations that there are not.
    """

    wire, dialects = "tcp", GROOT_DIALECTS

    def __init__(self, address: str, **settings: Unpack[ServerSettings]) -> None:
        super().__init__(address, **settings)
        host, port = host_and_port(address, _PORT)
        self._flat = settings.get("dialect") == "groot-sim"
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket: zmq.Socket[bytes] | None = None
        self._peer = f"tcp://{f'[{host}]' if ':' in host else host}:{port}"
        self.history = 0
        self._steps: dict[str, list[int]] = {}
        self._seen: deque[dict[str, dict[str, object]]] = deque(maxlen=1)
        try:
            check_listens(address, host, port, self.timeout)  # a socket of ZeroMQ waits for a server for ever
            self._call("ping")
            self._read_modalities(self._call("get_modality_config"))
        except BaseException:
            self.close()
            raise

    def reset(self, seed: int, sentence: str) -> None:  # noqa: ARG002 - the policy knows no seed
        """Begin an episode; see `Policy.reset`."""
        self._seen.clear()
        self._call("reset", {"options": None})

    def see(self, observation: Mapping[str, object]) -> None:
        """Take note of the observation of a control period without a request.

        Raises:
            PolicyError: a name that no policy of GR00T has.
        """
        try:
            self._seen.append(_by_modality(observation))
        except MessageError as error:
            raise PolicyError(f"observation: {error}") from None

    def close(self) -> None:
        """Close the connection; the server goes on."""
        self._drop()
        self._context.destroy(linger=0)

    def _request(self, observation: Mapping[str, object]) -> tuple[bytes, bytes]:
        self.see(observation)
        sent = self._batched()
        return pack(sent, NPY), _packed_request("get_action", {"observation": sent, "options": None})

    def _exchange(self, request: bytes) -> tuple[bytes, float]:
        socket = self._connected()
        start = time.monotonic()
        try:
            socket.send(request)
            raw = socket.recv()
        except zmq.Again:
            self._drop()  # a request that was not answered blocks its socket
            raise late(self._address, self.timeout) from None
        except zmq.ZMQError as error:
            self._drop()
            raise PolicyConnectionError(f"{self._address}: the connection is lost ({error})") from None
        return raw, time.monotonic() - start

    def _reply(self, raw: bytes) -> tuple[object, object, Mapping[str, object]]:
        reply = _decoded(raw)
        if not (isinstance(reply, list) and len(reply) == 2 and isinstance(reply[0], dict)):
            raise PolicyAnswerError("an answer must be a pair of actions and info")
        parts, info = reply
        if self._flat:
            parts = {key.removeprefix("action."): value for key, value in parts.items()}
        return parts, info, {"info": info}

    def _batched(self) -> dict[str, object]:
        """Return the newest observation as the server wants it, with the axes of batch and time."""
        batched = {
            modality: {name: self._over_time(modality, name) for name in values}
            for modality, values in self._seen[-1].items()
        }
        if not self._flat:
            return dict(batched)
        flat = {f"{each}.{name}": value for each in ("video", "state") for name, value in batched[each].items()}
        return flat | batched["language"]

    def _over_time(self, modality: str, name: str) -> Any:
        last, steps = len(self._seen) - 1, self._steps.get(modality, [0])
        seen = (self._seen[max(0, last + step)][modality].get(name) for step in steps)
        values: list[Any] = [self._with_axes(modality, name, value) for value in seen]
        return values[0] if modality == "language" else np.concatenate(values, axis=1)

    def _with_axes(self, modality: str, name: str, value: object) -> object:
        place = f"{modality}.{name}"
        if modality == "language":
            if not isinstance(value, str):
                raise MessageError(f"{place}: it must be text (got {type(value).__name__})")
            return [value] if self._flat else [[value]]
        array = np.asarray(value)
        if modality == "video":
            if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] != 3:
                raise MessageError(f"{place}: it must be a picture (H, W, 3) uint8 (got {array.shape} {array.dtype})")
            return array[np.newaxis, np.newaxis]
        if array.dtype.kind not in "biuf" or array.ndim > 1:
            raise MessageError(f"{place}: it must be numbers (D,) (got {array.shape} {array.dtype})")
        return array.astype(np.float32).reshape(1, 1, -1)

    def _read_modalities(self, reply: object) -> None:
        """Take the modalities over."""
        fields = reply if isinstance(reply, dict) else {}
        with self._placed():
            modalities = {name: _modality(name, each) for name, each in fields.items()}
            if missing := {"video", "state", "action"} - modalities.keys():
                raise PolicyAnswerError(f"no policy of GR00T: it has no modality {', '.join(sorted(missing))}")
        self.metadata = modalities
        self._steps = {name: modalities[name]["delta_indices"] for name in GROOT_MODALITIES if name in modalities}
        self.history = -min(min(steps) for steps in self._steps.values())
        self._seen = deque(maxlen=self.history + 1)
        if not self._actions.keys:
            self._actions = replace(self._actions, keys=tuple(modalities["action"]["modality_keys"]))

    def _call(self, endpoint: str, data: Mapping[str, object] | None = None) -> object:
        """Return an endpoint's reply."""
        raw, _ = self._exchange(_packed_request(endpoint, data))
        with self._placed():
            return _decoded(raw)

    def _connected(self) -> "zmq.Socket[bytes]":
        if self._context.closed:
            raise PolicyConnectionError(f"{self._address}: the policy is closed")
        if self._socket is None:
            self._socket = self._context.socket(zmq.REQ)
            self._socket.setsockopt(zmq.LINGER, 0)
            self._socket.setsockopt(zmq.MAXMSGSIZE, MAX_BYTES)
            self._socket.connect(self._peer)
        bound = max(1, round(self.timeout * 1000))  # [ms]
        self._socket.setsockopt(zmq.RCVTIMEO, bound)
        self._socket.setsockopt(zmq.SNDTIMEO, bound)
        return self._socket

    def _drop(self) -> None:
        socket, self._socket = self._socket, None
        if socket is not None:
            socket.close(linger=0)


def _modality(name: str, described: object) -> dict[str, Any]:
    """Return a modality as the server describes it.

    Raises:
        PolicyAnswerError: it is none, or one of observations that there are not.
    """
    fields = described.get("as_json") if isinstance(described, dict) else None
    keys, steps = (
        fields.get(each) if isinstance(fields, dict) else None for each in ("modality_keys", "delta_indices")
    )
    listed = isinstance(keys, list) and isinstance(steps, list)
    if not isinstance(fields, dict) or not listed or not all(isinstance(each, str) for each in keys or ()):
        raise PolicyAnswerError(f"modality {name}: it must have lists modality_keys and delta_indices")
    earliest = 0 if name == "language" else -MAX_HISTORY
    if name in GROOT_MODALITIES and not (
        steps and all(type(step) is int and earliest <= step <= 0 for step in steps) and len(steps) <= MAX_FRAMES
    ):
        raise PolicyAnswerError(
            f"modality {name}: its delta_indices must be 1 to {MAX_FRAMES} whole numbers from {earliest} to 0 "
            f"(got {steps})"
        )
    return fields


def _by_modality(observation: Mapping[str, object]) -> dict[str, dict[str, object]]:
    """Return the values of an observation by modality and name.

    Raises:
        MessageError: a name that no policy of GR00T has.
    """
    found: dict[str, dict[str, object]] = {each: {} for each in GROOT_MODALITIES}
    for key, value in observation.items():
        modality, _, name = key.partition(".")
        values = {name: value} if name else value
        if modality not in found or not isinstance(values, Mapping):
            raise MessageError(f"{key}: a key must be video.NAME, state.NAME or language.NAME; map the names")
        found[modality].update(values)
    return found


def _packed_request(endpoint: str, data: Mapping[str, object] | None) -> bytes:
    request: dict[str, object] = {"endpoint": endpoint}
    if data is not None:
        request["data"] = data
    if key := policy_key():
        request["api_token"] = key
    return pack(request, NPY)


def _decoded(raw: bytes) -> object:
    """Return a reply.

    Raises:
        MessageError: it cannot be read.
        PolicyAnswerError: it reports an error.
    """
    if raw == b"ERROR":
        raise PolicyAnswerError("the server answers ERROR; look at its log")
    reply = unpack(raw, NPY)
    if isinstance(reply, dict) and "error" in reply:
        raise PolicyAnswerError(f"the policy failed: {one_printable_line(str(reply['error'])[:1000])}")
    return reply
