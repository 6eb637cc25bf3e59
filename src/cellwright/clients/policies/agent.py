"""Agent that lets a policy work a cell or a robot's node, with the policy's latency in simulation time.

At a control instant time stands still: the observation is made, the policy answers, however long that takes, and then
time goes on. The wall clock decides nothing but the number of a measured latency.
"""

from __future__ import annotations

import base64
import hashlib
import logging
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass

from cellwright.clients.client.client import Client
from cellwright.clients.policies.cell_workplace import CellWorkplace
from cellwright.clients.policies.key_map import Cell, KeyMap, default_map
from cellwright.clients.policies.latency import WARM_UP, Latency, in_ticks
from cellwright.clients.policies.map_reader import load_map, map_of_text
from cellwright.clients.policies.observer import Observer, digest_of
from cellwright.clients.policies.policy import Answer, LookingBack, Policy, PolicyAnswerError
from cellwright.clients.policies.presets import map_path
from cellwright.clients.policies.recorded import RecordedPolicy
from cellwright.clients.policies.report import MAX_NUMBERS, MAX_REPLY, TOPIC, RequestReport, Rules, encoded_actions
from cellwright.clients.policies.schedule import Chosen, Request
from cellwright.clients.policies.spec import MEASURED, PolicySpec
from cellwright.clients.policies.targets import Targets
from cellwright.clients.policies.workplace import Workplace
from cellwright.config.control import period_ticks
from cellwright.middleware.messages.conversions import NANOSECONDS
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import UsageError

_FIRST = 10.0
"""Simulation time [s] in which everything that the map observes must have come."""
_TOO_LATE = "no action came in time for its instant; answer with longer chunks, or take --policy-mode sync"

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Setting:
    """Names of the cell or node that a policy works, and the map between them and the policy's."""

    cell: Cell
    key_map: KeyMap


class PolicyAgent:
    """Agent that asks a policy, and sends what it answers.

    Args:
        spec: the policy and its rules.
        make: makes the policy, for the channels and the map; called once a run.
        recorded: rules of a recorded episode, which replace those of the spec; None without.
    """

    def __init__(self, spec: PolicySpec, make: Callable[[Setting], Policy], recorded: Rules | None = None) -> None:
        self._spec, self._make, self._recorded = spec, make, recorded
        self.summary = "asked nothing"
        """The newest episode in a line."""

    def run(self, client: Client) -> None:
        """Work the cell until the competition is done.

        Raises:
            PolicyConnectionError: the policy cannot be reached, or is lost.
            PolicyAnswerError: it has answered something that is no action of this cell.
            DescriptionError: the map does not fit the cell.
        """
        if not getattr(client.transport, "welcome", {}).get("lockstep", True):
            raise UsageError("policy: time must stand still while it answers; serve the cell with --lockstep")
        self.work(CellWorkplace(client))

    def work(self, workplace: Workplace) -> None:
        """Work a cell, or a robot's node, until there is nothing more to do; errors as of `run`."""
        setting = Setting(workplace.names, self._map(workplace.names))
        with closing(self._make(setting)) as policy:
            sentence = self._sentence(workplace)
            policy.reset(self._spec.seed, sentence)
            observer = Observer(workplace, setting.key_map, sentence)
            workplace.start()
            if not workplace.client.wait_until(observer.is_complete, _FIRST):
                raise UsageError(f"policy: {', '.join(observer.missing())}: nothing has come within {_FIRST:g} s")
            rules = self._rules(workplace, setting, sentence)
            episode = _Episode(workplace, policy, observer, setting, rules)
            try:
                episode.run()
            finally:
                self.summary = episode.summary()
                log.info("policy: %s", self.summary)

    def _map(self, cell: Cell) -> KeyMap:
        if self._recorded is not None:
            text = self._recorded.map
            return map_of_text(text, cell) if text else default_map(cell)
        return load_map(map_path(self._spec.map), cell) if self._spec.map else default_map(cell)

    def _sentence(self, workplace: Workplace) -> str:
        if self._recorded is not None:
            return self._recorded.sentence
        return self._spec.sentence or workplace.sentence

    def _rules(self, workplace: Workplace, setting: Setting, sentence: str) -> Rules:
        if self._recorded is not None:
            return self._recorded
        spec, key_map = self._spec, setting.key_map
        source = spec.source
        return Rules(
            policy=spec.policy,
            latency="" if source is None else source.text,
            seed=spec.seed,
            timestep=setting.cell.timestep,
            begin=workplace.client.transport.now(),
            period=period_ticks(key_map.rate, setting.cell.timestep),
            mode=spec.rule,
            horizon=spec.chunk or key_map.chunk,
            drops_stale=key_map.drops_stale,
            thinks_first=spec.thinks_first,
            sentence=sentence,
            map=key_map.text,
        )


class _Episode:
    """One episode: from the first control instant to the end of the run."""

    def __init__(
        self, workplace: Workplace, policy: Policy, observer: Observer, setting: Setting, rules: Rules
    ) -> None:
        self._workplace, self._client = workplace, workplace.client
        self._policy, self._observer, self._rules = policy, observer, rules
        self._schedule = rules.schedule()
        self._targets = Targets(setting.key_map, setting.cell.space, workplace.arms)
        commanded = setting.key_map.channels(setting.cell)
        self._commander = workplace.commander(int(rules.period * rules.tick), commanded)
        self._latency = _latency_of(policy, rules)
        self._answers: dict[int, Answer] = {}
        self._before: Request | None = None
        self._delays: list[int] = []
        self._acts = False  # whether any answer has an action for an instant after it came
        self._is_held = False

    def run(self) -> None:
        """Ask and act at each control instant."""
        client, rules, schedule = self._client, self._rules, self._schedule
        self._begin()
        client.publish(TOPIC, String(rules.encode()))
        instant = 0
        looking_back = self._policy if isinstance(self._policy, LookingBack) and self._policy.history else None
        while not self._workplace.is_over():
            if schedule.is_due(instant):
                self._ask(instant)
            elif looking_back is not None:
                looking_back.see(self._observer.observation())
            if (chosen := schedule.choose(instant)) is not None:
                self._act(chosen)
            instant += rules.period
            client.sleep((rules.time(instant) - client.transport.now()) / NANOSECONDS)

    def _begin(self) -> None:
        """Let steps go on from where everything is now."""
        values = self._observer.values()
        self._targets.begin(values)
        self._commander.begin(values)
        self._is_held = False

    def _act(self, chosen: Chosen) -> None:
        """Send the targets of an action, if commands are taken now."""
        if not self._workplace.takes_commands():
            self._is_held = True
            return
        if self._is_held:
            self._begin()
        try:
            self._commander.send(self._targets.take(self._answers[chosen.request].actions[chosen.place]))
        except UsageError as error:
            raise PolicyAnswerError(f"request {chosen.request}: {error}") from None

    def summary(self) -> str:
        """Return what there is to say of the episode, in a line."""
        requests, tick = self._schedule.requests, float(self._rules.tick) / 1e6
        delay = f"{sum(self._delays) / requests * tick:.0f} ms from observation to action" if requests else "no action"
        late = "" if self._acts or not requests else f"; {_TOO_LATE}"
        return f"{requests} requests, {delay}{late}"

    def _ask(self, instant: int) -> None:
        """Ask the policy with what is observed now, and report that."""
        rules, schedule, number = self._rules, self._schedule, self._schedule.requests
        observation = self._observer.observation()
        digest, exposed = digest_of(observation), self._observer.exposed()
        if number == 0 and rules.latency.startswith(MEASURED) and not isinstance(self._policy, RecordedPolicy):
            for _ in range(WARM_UP):
                self._policy.infer(observation)
            self._policy.reset(rules.seed, rules.sentence)
        answer = self._policy.infer(observation)
        if answer.actions.size > MAX_NUMBERS:
            raise PolicyAnswerError(f"request {number}: at most {MAX_NUMBERS} numbers (got {answer.actions.size})")
        latency = self._latency(answer)
        request = schedule.ask(instant, latency=latency, length=len(answer.actions))
        kept = {each.number for each in (schedule.acting, schedule.coming) if each is not None}
        self._answers = {each: known for each, known in {**self._answers, number: answer}.items() if each in kept}
        self._delays.append(request.first - instant)
        self._acts |= request.index < len(answer.actions)
        before = self._before
        short = len(answer.raw) <= MAX_REPLY
        sent = RequestReport(
            number=number,
            observed=instant,
            latency=latency,
            ready=instant + request.latency,
            first=request.first,
            index=request.index,
            length=request.length,
            exposed={topic: rules.ticks(time) for topic, time in exposed.items()},
            wall=answer.wall,
            infer_ms=answer.infer_ms,
            observation_sha256=digest,
            request_sha256=answer.request_sha256,
            reply_sha256=hashlib.sha256(answer.raw).hexdigest(),
            reply=base64.b64encode(answer.raw).decode() if short else "",
            actions=encoded_actions(answer.actions),
            before=None if before is None else {"used": before.used, "dropped": before.dropped, "held": before.held},
        )
        self._before = request
        self._client.publish(TOPIC, String(sent.encode()))


def _latency_of(policy: Policy, rules: Rules) -> Callable[[Answer], int]:
    """Return the source of latencies [ticks] of an episode."""
    if isinstance(policy, RecordedPolicy):
        return policy.latency
    if not rules.latency:
        return lambda _answer: 0
    source = Latency.read(rules.latency).source(rules.seed)
    return lambda answer: in_ticks(source(answer), rules.tick)
