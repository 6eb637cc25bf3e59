"""Reports of a policy's episode, request by request, as JSON objects: what a recording keeps, and what replays them.

The first report says by which rules the policy is asked; each further one is a request with its answer. Ticks count
from the begin of the episode. From the rules alone follows which latency, first instant and action a request must have,
so that a changed number shows.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from cellwright.clients.policies.latency import Latency, Source, in_ticks
from cellwright.clients.policies.schedule import Chosen, Mode, Request, Schedule
from cellwright.middleware.messages.conversions import NANOSECONDS
from cellwright.util.errors import UsageError

TOPIC = "/cellwright/policy"
"""Topic of the cell that takes reports."""
MAX_REPLY = 1 << 19
"""Largest reply whose bytes are kept [bytes]; of a longer one the digest and the actions are."""
MAX_NUMBERS = 50_000
"""Most numbers in the actions of an answer."""
_END = 10**9  # of ticks: they last three weeks


@dataclass(frozen=True)
class Rules:
    """Rules by which a policy is asked in an episode: those of `Schedule`, and where answers and latencies are from.

    Attributes:
        policy: the policy's address or class, as given.
        latency: source of the latencies, as given; empty where the world stands still.
        seed: the run's seed.
        timestep: length of a tick [s], as numerator and denominator.
        begin: time of the first control instant [ns].
        sentence: the task.
        map: text of the key map; empty for that of the cell.
    """

    policy: str
    latency: str
    seed: int
    timestep: tuple[int, int]
    begin: int
    period: int
    mode: Mode
    horizon: int | None = None
    drops_stale: bool | None = None
    thinks_first: bool = False
    sentence: str = ""
    map: str = ""

    @property
    def tick(self) -> Fraction:
        """Length of a tick [ns]."""
        return NANOSECONDS * Fraction(*self.timestep)

    def time(self, ticks: int) -> int:
        """Return the time [ns] a number of ticks after the begin, for a client that waits for that tick.

        Clocks round to whole nanoseconds: where ticks are none, the time is a little before.
        """
        return self.begin + math.floor(ticks * self.tick) - (self.tick.denominator != 1)

    def ticks(self, time: int) -> int:
        """Return the ticks from the begin to a time [ns] that a clock has rounded."""
        return math.floor((time - self.begin + 1) / self.tick)

    def schedule(self) -> Schedule:
        """Return a schedule by these rules.

        Raises:
            UsageError: a number is not above 0.
        """
        return Schedule(
            self.period,
            mode=self.mode,
            horizon=self.horizon,
            drops_stale=self.drops_stale,
            thinks_first=self.thinks_first,
        )

    def encode(self) -> str:
        """Return the report as JSON."""
        return json.dumps({"rules": asdict(self)})


@dataclass(frozen=True)
class RequestReport:
    """A request and its answer.

    Attributes:
        number, observed, first, index, length: as of `Request`.
        latency: ticks between observation and answer, before the rules let the world stand still.
        ready: tick at which the answer exists.
        exposed: tick of each part of the observation that has a time of its own, by its topic.
        wall: wall time of the round trip [s].
        infer_ms: time of inference as the server reports it [ms].
        observation_sha256: digest of the observation, whatever the wire.
        request_sha256: digest of the request's bytes.
        reply_sha256: digest of the reply's bytes.
        reply: the reply's bytes as base64; empty if they are more than `MAX_REPLY`.
        actions: the actions as base64 of little-endian float64, row by row.
        before: of the request before, how many actions were `used` and `dropped`, and ticks `held` without one.
    """

    number: int
    observed: int
    latency: int
    ready: int
    first: int
    index: int
    length: int
    exposed: dict[str, int] = field(default_factory=dict)
    wall: float = 0.0
    infer_ms: float | None = None
    observation_sha256: str = ""
    request_sha256: str = ""
    reply_sha256: str = ""
    reply: str = ""
    actions: str = ""
    before: dict[str, int] | None = None

    def encode(self) -> str:
        """Return the report as JSON."""
        return json.dumps({"request": asdict(self)})

    def matrix(self) -> NDArray[np.float64]:
        """Return the actions, shape (H, D).

        Raises:
            UsageError: they are no matrix of finite numbers.
        """
        try:
            numbers = np.frombuffer(base64.b64decode(self.actions, validate=True), "<f8").astype(np.float64)
            found = numbers.reshape(self.length, -1)
        except ValueError as error:
            raise UsageError(f"request {self.number}: its actions cannot be read: {error}") from None
        if not found.size or not np.isfinite(found).all():
            raise UsageError(f"request {self.number}: its actions must be finite numbers")
        return found


def encoded_actions(actions: NDArray[np.float64]) -> str:
    """Return actions as base64 for a report."""
    return base64.b64encode(np.ascontiguousarray(actions, "<f8").tobytes()).decode()


def decode_report(text: str) -> Rules | RequestReport:
    """Return the report in a JSON text, which may come from anyone.

    Raises:
        UsageError: it is none.
    """
    try:
        document: dict[str, Any] = msgspec.json.decode(text, type=dict[str, Any])
        [(kind, values)] = document.items()
        found: Rules | RequestReport
        if kind == "rules":
            found = msgspec.convert(values, Rules)
            if not (0 < found.period < _END and all(0 < each < _END for each in found.timestep)):
                raise ValueError("a number is out of range")
        elif kind == "request":
            found = msgspec.convert(values, RequestReport)
            numbers = (found.number, found.observed, found.latency, found.ready, found.first, found.index)
            if not all(0 <= each < _END for each in numbers) or not 0 < found.length <= MAX_NUMBERS:
                raise ValueError("a number is out of range")
        else:
            raise ValueError(f"unknown kind {kind!r:.40}")
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise UsageError(f"no report of a policy: {error}") from None
    return found


class ReportCheck:
    """Check of the reports of an episode, in their order: whether each request is the one that the rules make.

    Args:
        on_silence: called with the instant and the action that acts there, where `action` is not called; it raises
            UsageError if that is a fault.

    Attributes:
        requests: number of requests so far.
        fault: the first fault, in a line that names the request; empty if there is none.
    """

    def __init__(self, on_silence: Callable[[int, Chosen], None] = lambda _instant, _chosen: None) -> None:
        self.requests = 0
        self.fault = ""
        self._rules: Rules | None = None
        self._schedule: Schedule | None = None
        self._latencies: Source | None = None
        self._instant = 0
        self._on_silence = on_silence
        self._answers: dict[int, NDArray[np.float64]] = {}

    def action(self, instant: int) -> tuple[int, NDArray[np.float64]] | None:
        """Return the request and its action, shape (D,), that act from an instant on; None if the robot holds then.

        Raises:
            UsageError: by the reports so far, there is no such instant, or another request or command comes before.
        """
        schedule = self._schedule
        while schedule is not None and self._instant <= instant:
            at = self._instant
            if schedule.is_due(at):
                raise UsageError(f"request {schedule.requests}: must be made at tick {at} by the rules (got none)")
            if at == instant:
                self._instant += schedule.period
                chosen = schedule.choose(at)
                return None if chosen is None else (chosen.request, self._answers[chosen.request][chosen.place])
            self._pass(schedule)
        raise UsageError(f"request {self.requests}: no command may come at tick {instant} by the rules")

    def take(self, text: str) -> None:
        """Check a report; after a fault nothing more is checked."""
        if self.fault:
            return
        try:
            report = decode_report(text)
            if isinstance(report, Rules):
                self._begin(report)
            else:
                self.requests += 1
                self._check(report)
        except UsageError as error:
            self.fault = str(error)

    def _begin(self, rules: Rules) -> None:
        self._rules, self._schedule, self._latencies, self._instant = rules, rules.schedule(), None, 0
        if rules.latency and rules.mode is not Mode.FROZEN and not rules.latency.startswith(("measured", "file:")):
            self._latencies = Latency.read(rules.latency).source(rules.seed)

    def _check(self, report: RequestReport) -> None:
        rules, schedule = self._rules, self._schedule
        if rules is None or schedule is None:
            raise UsageError(f"request {report.number}: comes before the rules")
        self._differs(report, "number", schedule.requests)
        while not schedule.is_due(self._instant):
            self._pass(schedule)
        self._differs(report, "observed", self._instant)
        if self._latencies is not None:
            self._differs(report, "latency", in_ticks(self._latencies(report), rules.tick))
        request: Request = schedule.ask(self._instant, latency=report.latency, length=report.length)
        self._differs(report, "ready", request.observed + request.latency)
        self._differs(report, "first", request.first)
        self._differs(report, "index", request.index)
        kept = {each.number for each in (schedule.acting, schedule.coming) if each is not None}
        self._answers = {each: known for each, known in self._answers.items() if each in kept}
        self._answers[report.number] = report.matrix()

    def _pass(self, schedule: Schedule) -> None:
        """Pass an instant that has no command."""
        at = self._instant
        self._instant += schedule.period
        chosen = schedule.choose(at)
        if chosen is not None:
            self._on_silence(at, chosen)

    def _differs(self, report: RequestReport, name: str, expected: int) -> None:
        found = getattr(report, name)
        if found != expected:
            raise UsageError(f"request {report.number}: {name} must be {expected} by the rules (got {found})")
