"""Replies of policy servers: bytes are actions, or refused in one line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from cellwright.clients.policies.actions import ActionFormat, extras, server_time
from cellwright.clients.policies.array_forms import LEBEDOV, NPY, OPENPI
from cellwright.clients.policies.codec import pack, pack_json, unpack, unpack_json
from cellwright.clients.policies.policy import PolicyAnswerError
from cellwright.util.errors import MessageError
from fuzz.verdict import FindingError

MAX_SIZE = 2000
WORDS = ("actions", "__ndarray__", "__npgeneric__", "dtype", "shape", "<f4", "|O", "as_npy", "\x93NUMPY", "__numpy__")

_FORMS = (OPENPI, LEBEDOV, NPY)
_READERS: list[Callable[[bytes], object]] = [*(partial(unpack, form=form) for form in _FORMS), unpack_json]
_FORMAT = ActionFormat(None, ("arm", "gripper"))


def seeds() -> Iterator[bytes]:
    """Yield replies in each form, prefixed with its number."""
    chunk = np.arange(6, dtype=np.float32).reshape(3, 2)
    for reply in (
        {"actions": chunk, "server_timing": {"infer_ms": 12.5}, "state": np.float32(1)},
        {"arm": chunk[np.newaxis], "gripper": chunk[np.newaxis, :, :1]},
        [[0.5, 1.0], [0.25, 0.0]],
    ):
        for number, form in enumerate(_FORMS):
            yield bytes([number]) + pack(reply, form)
        yield bytes([len(_FORMS)]) + pack_json(reply)


def attempt(data: bytes) -> None:
    """Read the bytes as a reply; actions are a finite chunk."""
    if not data:
        return
    try:
        reply = _READERS[data[0] % len(_READERS)](data[1:])
        actions = _FORMAT.read(reply)
    except (MessageError, PolicyAnswerError) as error:
        if not str(error) or len(str(error)) > 1500 or not str(error).isprintable():
            raise FindingError(f"a refusal that cannot be read: {str(error)!r:.300}") from None
        return
    extras(reply)
    server_time(reply)
    if actions.dtype != np.float64 or actions.ndim != 2 or not actions.size or not np.isfinite(actions).all():
        raise FindingError(f"no chunk of actions: {actions!r:.300}")
