"""Dialects by name; those of OpenPI's websocket have the same frames, with other arrays, fields and resets."""

import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from cellwright.clients.policies.array_forms import LEBEDOV, OPENPI, ArrayForm
from cellwright.clients.policies.policy import PolicyAnswerError
from cellwright.util.errors import one_printable_line

ACT_DIALECTS: Final = ("act", "act-encoded")
"""Dialects of HTTP: an observation as JSON; and the same as a text in `{"encoded": …}`, answered by a text."""
GROOT_DIALECTS: Final = ("groot", "groot-sim")
"""Dialects of GR00T: the policy itself; and behind its wrapper for simulators, with flat keys."""

GROOT_MODALITIES: Final = ("video", "state", "language")
"""Modalities of the observations of GR00T, whose names are such as `video.NAME`."""

_VLLM_KEYS = ("action_horizon", "max_action_horizon", "default_action_horizon", "action_dim", "action_keys")


@dataclass(frozen=True)
class Dialect:
    """Additions of a kind of server to OpenPI's frames.

    Attributes:
        name: its name.
        arrays: its form of arrays.
        has_endpoints: a request says whether it is a reset or an observation, and of which session.
        has_seed: a request may have a seed, with which the policy repeats itself.
    """

    name: str
    arrays: ArrayForm
    has_endpoints: bool = False
    has_seed: bool = False

    def observation_fields(self, session: str, seed: int) -> Mapping[str, object]:
        """Return what a request needs beside the observation."""
        fields: dict[str, object] = {}
        if self.has_endpoints:
            fields |= {"endpoint": "infer", "session_id": session}
        if self.has_seed:
            fields["seed"] = seed
        return fields

    def reset_fields(self, session: str) -> Mapping[str, object] | None:
        """Return the message that begins an episode; None if the server knows none."""
        return {"endpoint": "reset", "session_id": session} if self.has_endpoints else None


DIALECTS: Final = {
    each.name: each
    for each in (
        Dialect("openpi", OPENPI),
        Dialect("lebedov", LEBEDOV),
        Dialect("roboarena", OPENPI, has_endpoints=True),
        Dialect("vllm", OPENPI, has_endpoints=True, has_seed=True),
    )
}
"""Dialects by name: OpenPI itself (openpi@15a9616) and openpi-server; MolmoSpaces and XPolicyLab; RoboArena
(roboarena@6fa329f) and DreamZero; vLLM-Omni (vllm-omni@83bb06f)."""


DIALECT_NAMES: Final = (*DIALECTS, *ACT_DIALECTS, *GROOT_DIALECTS)
"""Names of the dialects of all wires."""


def detected_dialect(metadata: Mapping[str, object]) -> Dialect:
    """Return the dialect that a server's first frame shows.

    `action_space` is of RoboArena's configuration, which vLLM-Omni extends by its horizons and keys. MolmoSpaces and
    XPolicyLab send a `model_name`.

    Example:
        >>> detected_dialect({"action_space": "joint_position", "action_dim": 8}).name, detected_dialect({}).name
        ('vllm', 'openpi')
    """
    if "action_space" in metadata:
        return DIALECTS["vllm" if any(key in metadata for key in _VLLM_KEYS) else "roboarena"]
    return DIALECTS["lebedov" if "model_name" in metadata else "openpi"]


def new_session() -> str:
    """Return a name of a session that no other client of the server has."""
    return uuid.uuid4().hex


def reported_error(reply: object) -> str | None:
    """Return the text of an error that a server sent as a map; None if the reply is none."""
    if isinstance(reply, Mapping) and reply.get("type") == "error":
        return str(reply.get("message", "no reason given"))
    return None


def check_reset(reply: object) -> None:
    """Accept the answer to a reset: text "reset successful", or a map whose status says so.

    Raises:
        PolicyAnswerError: it says something else.
    """
    text = reply.get("status") if isinstance(reply, Mapping) else reply
    if not isinstance(text, str) or "reset" not in text.lower() or "success" not in text.lower():
        raise PolicyAnswerError(f"the reset was not confirmed (got {one_printable_line(str(reply)[-300:])!r})")
