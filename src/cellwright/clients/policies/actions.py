"""Chunks of actions from the replies of policies, whatever shape a server gives them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cellwright.clients.policies.policy import PolicyAnswerError
from cellwright.util.errors import one_printable_line

_ACTION_KEYS = ("actions", "action")
_TIMINGS = ("policy_timing", "server_timing")

Actions = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ActionFormat:
    """Shape and parts that the actions of a reply must have.

    Attributes:
        dimension: numbers of an action; None takes any.
        keys: names of the parts of an action, in order, where a reply has an array for each: vLLM-Omni's `action_keys`,
            GR00T's modality keys.
    """

    dimension: int | None = None
    keys: tuple[str, ...] = ()

    def read(self, reply: object) -> Actions:
        """Return the actions of a decoded reply.

        A reply is an array, a list of numbers, a mapping that has one of these as `actions` or `action`, or a mapping
        with an array for each of `keys`. One action (D,) is a chunk of one; a batch (1, H, D) is its only chunk.

        Returns:
            Actions of shape (H, D), finite.

        Raises:
            PolicyAnswerError: there are no actions, or others than these.

        Example:
            >>> ActionFormat(dimension=2).read({"actions": [[0.5, 1.0], [0.25, 0.0]]}).shape
            (2, 2)
            >>> ActionFormat(dimension=7).read({"actions": [[0.5, 1.0]]})
            Traceback (most recent call last):
            cellwright.clients.policies.policy.PolicyAnswerError: actions: an action must have 7 numbers (got 2)
        """
        place, found = self._find(reply)
        if isinstance(found, Mapping):
            parts = [_chunk(found[key], None, f"{place}/{key}") for key in self.keys]
            lengths = {len(each) for each in parts}
            if len(lengths) > 1:
                raise PolicyAnswerError(f"{place}: all parts must have equally many actions (got {sorted(lengths)})")
            found = np.concatenate(parts, axis=1)
        return _chunk(found, self.dimension, place)

    def _find(self, reply: object) -> tuple[str, object]:
        """Return place and value of the actions in a reply: an array, a list, or a mapping that has all of `keys`."""
        if not isinstance(reply, Mapping):
            return "actions", reply
        for key in _ACTION_KEYS:
            if key in reply:
                inner = reply[key]
                if isinstance(inner, Mapping):
                    return key, self._parts(inner, key)
                return key, inner
        if isinstance(problem := reply.get("error", reply.get("message")), str):
            raise PolicyAnswerError(f"the policy reports: {one_printable_line(problem[:1000])}")
        return "actions", self._parts(reply, "the reply")

    def _parts(self, fields: Mapping[str, object], place: str) -> Mapping[str, object]:
        missing = [key for key in self.keys if key not in fields]
        if missing or not self.keys:
            wanted = f"{', '.join(missing)} of its action keys" if missing else "actions"
            raise PolicyAnswerError(f"{place}: it must have {wanted} (got the keys {_names(fields)})")
        return fields


def server_time(reply: object) -> float | None:
    """Return the time that a server says it took [ms]: `infer_ms` of `policy_timing` or `server_timing`.

    The latter is the whole call of the policy, as its server measures it, so it comes first.
    """
    if isinstance(reply, Mapping):
        for name in reversed(_TIMINGS):
            times = reply.get(name)
            value = times.get("infer_ms") if isinstance(times, Mapping) else None
            if isinstance(value, (int, float)) and not isinstance(value, bool) and 0.0 <= value < float("inf"):
                return float(value)
    return None


def extras(reply: object) -> Mapping[str, object]:
    """Return the entries of a reply beside its actions."""
    if not isinstance(reply, Mapping):
        return {}
    return {key: value for key, value in reply.items() if key not in _ACTION_KEYS}


def _chunk(value: object, dimension: int | None, place: str) -> Actions:
    """Return a value as a chunk (H, D)."""
    if isinstance(value, list):
        value = _from_list(value, place)
    if not isinstance(value, np.ndarray):
        raise PolicyAnswerError(f"{place}: it must be an array of numbers (got {type(value).__name__})")
    if value.dtype.kind not in "fiu":
        raise PolicyAnswerError(f"{place}: it must be an array of floats (got {value.dtype})")
    chunk = value.astype(np.float64)
    if chunk.ndim == 3 and len(chunk) == 1:
        chunk = chunk[0]
    elif chunk.ndim == 1:
        chunk = chunk[np.newaxis]
    if chunk.ndim != 2:
        raise PolicyAnswerError(f"{place}: its shape must be (H, D), (D,) or (1, H, D) (got {value.shape})")
    if 0 in chunk.shape:
        raise PolicyAnswerError(f"{place}: it must have at least one action (got shape {value.shape})")
    if dimension is not None and chunk.shape[1] != dimension:
        raise PolicyAnswerError(f"{place}: an action must have {dimension} numbers (got {chunk.shape[1]})")
    if not np.isfinite(chunk).all():
        step, number = np.argwhere(~np.isfinite(chunk))[0]
        raise PolicyAnswerError(f"{place}: action {step}, number {number} must be finite (got {chunk[step, number]})")
    return chunk


def _from_list(value: Sequence[object], place: str) -> npt.NDArray[Any]:
    """Return a list of numbers, or of equally long lists of them, as an array; text stays text and is refused."""
    try:
        return np.array(value)
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise PolicyAnswerError(f"{place}: it must be a list of equally many numbers each") from None


def _names(fields: Mapping[str, object]) -> str:
    return one_printable_line(", ".join(map(str, list(fields)[:12])) or "none")
