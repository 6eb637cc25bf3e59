"""Policy of a run, as the words of a command line: who it is, and by which rules it is asked."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from cellwright.clients.policies.latency import OPTION as LATENCY
from cellwright.clients.policies.latency import Latency
from cellwright.clients.policies.presets import map_path
from cellwright.clients.policies.schedule import Mode
from cellwright.util.errors import UsageError, did_you_mean

AGENT = "policy"
"""Name of the agent that lets a policy work; the words of a policy follow it."""
POLICY, MAP, MODE, CHUNK, THINK_FIRST = "--policy", "--policy-map", "--policy-mode", "--chunk", "--think-first"
SENTENCE = "--sentence"
_SEED = "--policy-seed"  # of each run, for its own process
MAX_CHUNK = 10_000
MEASURED = "measured"
RECORDING, REPORTS = ".mcap", ".jsonl"
"""Suffixes of a recording, and of a file with the reports of an episode in it, a line each."""


@dataclass(frozen=True, slots=True)
class PolicySpec:
    """A policy and its rules.

    Example:
        >>> spec = PolicySpec.of("ws://127.0.0.1:8000", latency="120ms")
        >>> spec.words
        'policy --policy ws://127.0.0.1:8000 --latency 120ms'
        >>> PolicySpec.read(spec.words) == spec, spec.rule
        (True, <Mode.ASYNC: 'async'>)

    Attributes:
        policy: address of a server, `path.py:Class`, `hold`, `random`, or the reports of a recorded episode.
        map: file of the key map, or a preset; empty for that of the cell.
        latency: source of the latencies; empty for the one that the mode implies.
        mode: mode of the schedule; empty for `frozen` without a latency, else `async`.
        chunk: number of actions after which it is asked again; None: that of the map.
        thinks_first: True if the world stands still for the first request.
        seed: seed of the run.
        sentence: the task in words; empty for that of the trial.
    """

    policy: str
    map: str = ""
    latency: str = ""
    mode: str = ""
    chunk: int | None = None
    thinks_first: bool = False
    seed: int = 0
    sentence: str = ""

    @classmethod
    def of(
        cls,
        policy: str,
        *,
        map_file: str = "",
        latency: str = "",
        mode: str = "",
        chunk: int | None = None,
        thinks_first: bool = False,
        sentence: str = "",
    ) -> PolicySpec:
        """Return the policy of these options.

        Raises:
            UsageError: a value is not valid, or two do not go together.
        """
        found = cls(policy, map_file, latency, mode, chunk, thinks_first, sentence=sentence)
        found.check()
        return found

    @classmethod
    def read(cls, words: str) -> PolicySpec:
        """Read `words`.

        Raises:
            UsageError: they are none.
        """
        try:
            rest = iter(shlex.split(words)[1:])
        except ValueError as error:
            raise UsageError(f"agent {AGENT}: {error}; put values with blanks into quotes") from None
        given: dict[str, str] = {}
        for word in rest:
            given[word] = "" if word == THINK_FIRST else next(rest, "")
        known = (POLICY, MAP, LATENCY, MODE, CHUNK, THINK_FIRST, _SEED, SENTENCE)
        if unknown := [word for word in given if word not in known]:
            raise UsageError(f"agent {AGENT}: unknown option {unknown[0]}{did_you_mean(unknown[0], known)}")
        if not given.get(POLICY):
            raise UsageError(f"agent {AGENT}: no policy given; add {POLICY}, such as {POLICY} ws://127.0.0.1:8000")
        try:
            chunk, seed = (int(given[name]) if name in given else None for name in (CHUNK, _SEED))
        except ValueError:
            raise UsageError(f"agent {AGENT}: {CHUNK} must be a whole number (got {given.get(CHUNK)})") from None
        found = cls(
            given[POLICY],
            given.get(MAP, ""),
            given.get(LATENCY, ""),
            given.get(MODE, ""),
            chunk,
            THINK_FIRST in given,
            seed or 0,
            given.get(SENTENCE, ""),
        )
        found.check()
        return found

    @property
    def words(self) -> str:
        """The words of a command line that say the same, but for the seed of a run of its own."""
        options = {POLICY: self.policy, MAP: self.map, LATENCY: self.latency, MODE: self.mode, SENTENCE: self.sentence}
        words = [AGENT, *(word for name, value in options.items() if value for word in (name, value))]
        words += [CHUNK, str(self.chunk)] if self.chunk is not None else []
        words += [THINK_FIRST] if self.thinks_first else []
        words += [_SEED, str(self.seed)] if self.seed else []
        return shlex.join(words)

    @property
    def rule(self) -> Mode:
        """The mode of the schedule."""
        return Mode(self.mode) if self.mode else Mode.ASYNC if self.latency else Mode.FROZEN

    @property
    def source(self) -> Latency | None:
        """The source of latencies; None where the world stands still."""
        return None if self.rule is Mode.FROZEN else Latency.read(self.latency or MEASURED)

    @property
    def is_recorded(self) -> bool:
        """True if the policy is a recorded episode, given as its reports."""
        return self.policy.endswith(REPORTS)

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that its answers and its rules depend on, besides a program."""
        kind, _, path = self.latency.partition(":")
        named = [path if kind == "file" else "", self.policy if self.is_recorded else ""]
        maps = [map_path(self.map)] if self.map else []
        return (*maps, *(Path(each) for each in named if each))

    def check(self) -> None:
        """Refuse values that are not valid.

        Raises:
            UsageError: a value is not valid, or two do not go together.
        """
        if self.mode and self.mode not in tuple(Mode):
            raise UsageError(f"{MODE} {self.mode}: give {', '.join(Mode)}")
        if self.chunk is not None and not 1 <= self.chunk <= MAX_CHUNK:
            raise UsageError(f"{CHUNK} {self.chunk}: must be from 1 to {MAX_CHUNK}")
        if self.rule is Mode.FROZEN and self.latency:
            raise UsageError(f"{MODE} {Mode.FROZEN}: the world stands while the policy thinks; leave out {LATENCY}")
        given = (self.map, self.latency, self.mode, self.chunk, self.thinks_first, self.sentence)
        if self.policy.endswith((RECORDING, REPORTS)) and any(given):
            raise UsageError(f"{POLICY} {self.policy}: the recording has its own rules; leave out the other options")
        _ = self.source


def is_policy(agent: str) -> bool:
    """Return whether the name of an agent says a policy with its rules."""
    return agent.partition(" ")[0] == AGENT
