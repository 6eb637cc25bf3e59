"""Runs of an evaluation that have no result, since the machine or a policy's server ended each of their starts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class InfrastructureLoss:
    """Run that was lost to the infrastructure: it counts in no figure, and the same command runs it again.

    Attributes:
        trial: name of the trial.
        seed: seed of the run.
        fault: reason of its end, in one line.

    Example:
        >>> InfrastructureLoss("lesson", 2, "ws://127.0.0.1:1: cannot be reached; no result after 3 starts").line
        'lesson seed 2: ws://127.0.0.1:1: cannot be reached; no result after 3 starts'
    """

    trial: str
    seed: int
    fault: str

    @property
    def line(self) -> str:
        """The run and its fault, in one line."""
        return f"{self.trial} seed {self.seed}: {self.fault}"


def loss_counts(lost: Iterable[InfrastructureLoss]) -> dict[str, int]:
    """Return the number of lost runs of each trial, in the order of their first ones."""
    return dict(Counter(each.trial for each in lost))
