"""Shards of an evaluation: which of its runs one of several machines does."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self, TypeVar

from cellwright.util.errors import UsageError

_FIRST = {"SLURM_ARRAY_TASK_ID": 1, "JOB_COMPLETION_INDEX": 0}
"""Variables with the number of a task, and the number that they have in its first task."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Shard:
    """One of `count` parts of an evaluation; `number` is from 1 to `count`."""

    number: int
    count: int

    @classmethod
    def read(cls, text: str, variables: Mapping[str, str] = os.environ) -> Self:
        """Read a shard such as `3/16`, `auto/16` or `auto`.

        With `auto` the number comes from a task of a Slurm array, numbered from 1, or of an indexed Job of Kubernetes.
        Without `/N` the count comes from Slurm. That of Kubernetes is no variable.

        Raises:
            UsageError: the text is none of these, or the variables are missing or do not fit.
        """
        number, has_count, count = text.partition("/")
        if number == "auto":
            number = str(_task_number(text, variables))
            count = count if has_count else _task_count(variables)
        if not _is_number(number) or not _is_number(count) or not 1 <= int(number) <= int(count):
            got = "" if text == f"{number}/{count}" else f" (got {number}/{count})"
            raise UsageError(f"{text}: give K/N with K from 1 to N, such as 3/16, or auto/16{got}")
        return cls(int(number), int(count))

    def select(self, runs: Sequence[T]) -> Sequence[T]:
        """Return the runs of this shard, in their order.

        The shards hold each run once, and equal numbers of every block of the sequence, such as a trial's, give or take
        one.
        """
        return runs[self.number - 1 :: self.count]

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) < 10


def _task_number(text: str, variables: Mapping[str, str]) -> int:
    for name, first in _FIRST.items():
        if value := variables.get(name):
            if not _is_number(value) or int(value) < first:
                raise UsageError(f"{text}: {name} must be a number from {first} (got {value})")
            return int(value) - first + 1
    raise UsageError(f"{text}: none of {', '.join(_FIRST)} is set; give K/N, such as 3/16")


def _task_count(variables: Mapping[str, str]) -> str:
    """Return the number of tasks of a Slurm array; a part of an array, such as of failed tasks, does not tell it."""
    first, last, count = (variables.get(f"SLURM_ARRAY_TASK_{name}", "") for name in ("MIN", "MAX", "COUNT"))
    if first != "1" or last != count:
        raise UsageError("auto: the number of shards is unknown without a Slurm array from 1; give auto/N")
    return count
