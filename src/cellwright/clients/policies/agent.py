"""Agent that lets a policy work a cell through a client, with the policy's latency in simulation time.

At a control instant time stands still: the observation is made, the policy answers, however long that takes, and then
time goes on. The wall clock decides nothing but the number of a measured latency.
"""

from __future__ import annotations

import base64
import hashlib
import logging
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from cellwright.clients.client.client import Client
from cellwright.clients.client.pictures import picture_topics
from cellwright.clients.policies.commands import Commands
from cellwright.clients.policies.key_map import Cell, KeyMap, default_map
from cellwright.clients.policies.latency import WARM_UP, Latency, in_ticks
from cellwright.clients.policies.map_reader import load_map, map_of_text
from cellwright.clients.policies.observer import Observer, digest_of
from cellwright.clients.policies.policy import Answer, LookingBack, Policy, PolicyAnswerError
from cellwright.clients.policies.recorded import RecordedPolicy
from cellwright.clients.policies.report import MAX_NUMBERS, MAX_REPLY, TOPIC, RequestReport, Rules, encoded_actions
from cellwright.clients.policies.schedule import Request
from cellwright.clients.policies.spec import MEASURED, PolicySpec
from cellwright.clients.policies.targets import Targets, ToolArm
from cellwright.config.control import period_ticks
from cellwright.middleware.messages.conversions import NANOSECONDS
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import UsageError

_FIRST = 10.0
"""Simulation time [s] in which everything that the map observes must have come."""
_COLOUR = "image_raw"

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Setting:
    """A cell as a policy agent has it: its names, the map, and the arms whose tools the map uses."""

    cell: Cell
    key_map: KeyMap
    arms: Mapping[str, ToolArm]


class PolicyAgent:
    """Agent that asks a policy, and sends the cell what it answers.

    Args:
        spec: the policy and its rules.
        make: makes the policy, for the cell's channels and the map; called once a run.
        recorded: rules of a recorded episode, which replace those of the spec; None without.
    """

    def __init__(self, spec: PolicySpec, make: Callable[[Setting], Policy], recorded: Rules | None = None) -> None:
        self._spec, self._make, self._recorded = spec, make, recorded

    def run(self, client: Client) -> None:
        """Work the cell until the competition is done.

        Raises:
            PolicyConnectionError: the policy cannot be reached, or is lost.
            PolicyAnswerError: it has answered something that is no action of this cell.
            DescriptionError: the map does not fit the cell.
        """
        if not getattr(client.transport, "welcome", {}).get("lockstep", True):
            raise UsageError("policy: time must stand still while it answers; serve the cell with --lockstep")
        setting = self._setting(client)
        with closing(self._make(setting)) as policy:
            sentence = client.sentence
            policy.reset(self._spec.seed, sentence)
            observer = Observer(client, setting.key_map, setting.cell.space, setting.arms, sentence)
            client.start_competition()
            if not client.wait_until(observer.is_complete, _FIRST):
                raise UsageError(f"policy: {', '.join(observer.missing())}: nothing has come within {_FIRST:g} s")
            episode = _Episode(client, policy, observer, setting, self._rules(client, setting, sentence))
            try:
                episode.run()
            finally:
                log.info("policy: %s", episode.summary())

    def _setting(self, client: Client) -> Setting:
        cell = cell_of(client)
        if self._recorded is not None:
            text = self._recorded.map
            key_map = map_of_text(text, cell) if text else default_map(cell)
        else:
            key_map = load_map(Path(self._spec.map), cell) if self._spec.map else default_map(cell)
        return Setting(cell, key_map, arms_of(client, cell))

    def _rules(self, client: Client, setting: Setting, sentence: str) -> Rules:
        if self._recorded is not None:
            return self._recorded
        spec, key_map = self._spec, setting.key_map
        numerator, denominator = setting.cell.timestep
        source = spec.source
        return Rules(
            policy=spec.policy,
            latency="" if source is None else source.text,
            seed=spec.seed,
            tick=NANOSECONDS * numerator // denominator,
            begin=client.transport.now(),
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

    def __init__(self, client: Client, policy: Policy, observer: Observer, setting: Setting, rules: Rules) -> None:
        self._client, self._policy, self._observer, self._rules = client, policy, observer, rules
        self._schedule = rules.schedule()
        self._targets = Targets(setting.key_map, setting.cell.space, setting.arms)
        self._commands = Commands(client, setting.cell.space, rules.period * rules.tick)
        self._latency = _latency_of(policy, rules)
        self._answers: dict[int, Answer] = {}
        self._before: Request | None = None
        self._delays: list[int] = []

    def run(self) -> None:
        """Ask and act at each control instant."""
        client, rules, schedule = self._client, self._rules, self._schedule
        begin = client.transport.now()
        values = self._observer.values()
        self._targets.begin(values)
        self._commands.begin(values)
        client.publish(TOPIC, String(rules.encode()))
        instant = 0
        looking_back = self._policy if isinstance(self._policy, LookingBack) and self._policy.history else None
        while client.competition_state != "done":
            if schedule.is_due(instant):
                self._ask(instant, begin)
            elif looking_back is not None:
                looking_back.see(self._observer.observation())
            if (chosen := schedule.choose(instant)) is not None:
                action = self._answers[chosen.request].actions[chosen.place]
                try:
                    self._commands.send(self._targets.take(action))
                except UsageError as error:
                    raise PolicyAnswerError(f"request {chosen.request}: {error}") from None
            instant += rules.period
            client.sleep((begin + instant * rules.tick - client.transport.now()) / NANOSECONDS)

    def summary(self) -> str:
        """Return what there is to say of the episode, in a line."""
        requests, tick = self._schedule.requests, self._rules.tick / 1e6
        delay = f"{sum(self._delays) / requests * tick:.0f} ms from observation to action" if requests else "no action"
        return f"{requests} requests, {delay}"

    def _ask(self, instant: int, begin: int) -> None:
        """Ask the policy with what is observed now, and report that to the cell."""
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
            exposed={topic: (time - begin) // rules.tick for topic, time in exposed.items()},
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


def cell_of(client: Client) -> Cell:
    """Return the names of a client's cell: channels, cameras with colours, and arms."""
    topics = client.transport.topics()
    firsts = dict.fromkeys(name.split("/")[2] for name in topics if name.startswith("/ariac/") and name.count("/") > 2)
    cameras = [name for name in firsts if _COLOUR in picture_topics(f"/ariac/{name}", topics)]
    return Cell(client.control_space(), cameras, tuple(client.chains()), client.timestep())


def arms_of(client: Client, cell: Cell) -> dict[str, ToolArm]:
    """Return the arms of a client's cell by name."""
    chains, places = client.chains(), {(each.arm, each.joint): n for n, each in enumerate(cell.space.channels)}
    return {
        arm.name: ToolArm(
            chains[arm.name], arm.pose, tuple(places[arm.namespace, each.name] for each in chains[arm.name].joints)
        )
        for arm in client.layout().arms
    }


def _latency_of(policy: Policy, rules: Rules) -> Callable[[Answer], int]:
    """Return the source of latencies [ticks] of an episode."""
    if isinstance(policy, RecordedPolicy):
        return policy.latency
    if not rules.latency:
        return lambda _answer: 0
    source = Latency.read(rules.latency).source(rules.seed)
    return lambda answer: in_ticks(source(answer), rules.tick)
