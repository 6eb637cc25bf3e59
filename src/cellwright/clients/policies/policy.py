"""The interface of policies, and their errors."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from cellwright.util.errors import CellwrightError


class PolicyError(CellwrightError):
    """No such policy, or it cannot be made: a fault of the call."""


class PolicyConnectionError(CellwrightError):
    """A policy server that cannot be reached, is lost, or is late: a fault of infrastructure, not of the policy."""


class PolicyAnswerError(CellwrightError):
    """An answer that is none, or a reported error; like PolicyConnectionError, no verdict on the policy."""


@dataclass(frozen=True)
class Answer:
    """A policy's answer to one observation.

    Attributes:
        actions: actions of a chunk, one for each control period: float64, shape (H, D), H at least 1, all finite.
        raw: bytes of the reply as received; of a policy in this process, its actions as MessagePack.
        request_sha256: SHA-256 of the observation as it was sent, in hexadecimal digits. What a dialect adds, such as
            the name of a session, is not part of it.
        wall: time from just before the first byte was sent until the last was received [s], without packing.
        infer_ms: time that the server says it took, without transport [ms]; None if it does not say.
        extras: further entries of the reply, such as `state` and `server_timing`.
    """

    actions: npt.NDArray[np.float64]
    raw: bytes
    request_sha256: str
    wall: float
    infer_ms: float | None = None
    extras: Mapping[str, object] = field(default_factory=dict)


@runtime_checkable
class Policy(Protocol):
    """A policy: asked in one thread, one observation at a time."""

    @property
    def metadata(self) -> Mapping[str, object]:
        """Facts that the policy states of itself; empty if none."""

    def reset(self, seed: int, sentence: str) -> None:
        """Begin an episode; a lost connection is made again here, and nowhere else.

        Args:
            seed: seed of the episode.
            sentence: its task in words; may be empty.

        Raises:
            PolicyConnectionError: the server cannot be reached.
            PolicyAnswerError: it refuses.
        """

    def infer(self, observation: Mapping[str, object]) -> Answer:
        """Return the answer to an observation.

        Args:
            observation: values by the policy's own names: arrays, text, numbers, and mappings of these. Pictures are
                arrays (H, W, 3) uint8, unless the policy wants others.

        Raises:
            PolicyConnectionError: the connection is lost, or no answer came in time.
            PolicyAnswerError: the answer is an error, or no chunk of actions.
        """

    def close(self) -> None:
        """Release everything; a second call does nothing."""


@runtime_checkable
class LookingBack(Protocol):
    """A policy that wants earlier observations too.

    Attributes:
        history: number of control periods that it looks back; 0: none.
    """

    history: int

    def see(self, observation: Mapping[str, object]) -> None:
        """Take note of the observation of a control period without a request."""
