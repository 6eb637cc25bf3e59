"""Policy of a recorded episode: it answers as it did then, with the latency of then, and needs no server."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Self

from cellwright.clients.policies.observer import digest_of
from cellwright.clients.policies.policy import Answer, PolicyAnswerError
from cellwright.clients.policies.report import RequestReport, Rules, decode_report
from cellwright.util.errors import UsageError

MAX_BYTES = 1 << 30
"""Largest file of reports that is read [bytes]."""


class RecordedPolicy:
    """The answers of an episode, in their order.

    Args:
        rules: the episode's rules.
        requests: its requests.
    """

    def __init__(self, rules: Rules, requests: Sequence[RequestReport]) -> None:
        self.rules, self._requests = rules, requests
        self._next = 0

    @classmethod
    def of(cls, reports: Sequence[str], place: str) -> Self:
        """Return the policy of reports in their order; `place` names them in errors.

        Raises:
            UsageError: they are not those of one episode.
        """
        try:
            found = [decode_report(text) for text in reports]
        except UsageError as error:
            raise UsageError(f"{place}: {error}") from None
        rules = [each for each in found if isinstance(each, Rules)]
        requests = [each for each in found if isinstance(each, RequestReport)]
        if len(rules) != 1 or not requests or not isinstance(found[0], Rules):
            raise UsageError(f"{place}: holds no episode of a policy; record one with --policy and --record")
        return cls(rules[0], requests)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file with a report a line; errors as of `of`."""
        try:
            if path.stat().st_size > MAX_BYTES:
                raise UsageError(f"{path}: is larger than {MAX_BYTES >> 20} MiB")
            return cls.of(path.read_text(encoding="utf-8").splitlines(), str(path))
        except (OSError, UnicodeDecodeError) as error:
            raise UsageError(f"{path}: cannot be read: {error}") from None

    @property
    def metadata(self) -> Mapping[str, object]:
        """The policy that gave the answers."""
        return {"policy": self.rules.policy}

    def reset(self, seed: int, sentence: str) -> None:
        """Begin the episode again; another seed or task shows in the first observation that differs."""
        del seed, sentence
        self._next = 0

    def infer(self, observation: Mapping[str, object]) -> Answer:
        """Return the next answer.

        Raises:
            PolicyAnswerError: there is none, or the observation is another one than then.
        """
        if self._next >= len(self._requests):
            raise PolicyAnswerError(f"request {self._next}: the recording has only {len(self._requests)} requests")
        report = self._requests[self._next]
        if digest_of(observation) != report.observation_sha256:
            raise PolicyAnswerError(
                f"request {report.number}: the observation is not the recorded one; run the same trial with the same "
                "seed, where pictures are drawn alike"
            )
        self._next += 1
        return Answer(report.matrix(), b"", report.request_sha256, report.wall, report.infer_ms)

    def latency(self, _answer: Answer) -> int:
        """Return the latency [ticks] of the newest answer."""
        return self._requests[self._next - 1].latency

    def close(self) -> None:
        """Do nothing: there is no connection."""
