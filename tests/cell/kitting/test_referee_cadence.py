"""The referee at every tick, at deadlines only, and interrupted by snapshots: all agree with the naive rules."""

from __future__ import annotations

import json
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.cell.kitting.effects import Effect, OrderAnnounced, OrderCompleted, StateChanged
from cellwright.cell.kitting.inventory import TrayContents
from cellwright.cell.kitting.referee import Referee
from cellwright.config.trial.trial import Order, Trial
from cellwright.util.errors import RejectedCommandError
from tests.cell.kitting.builders import TRAY_1, TRAY_2, TYPES, contents, order
from tests.cell.kitting.naive_referee import LogEntry, NaiveReferee

TICK = 2_000_000
TICKS = 60
NAMES = [f"order_{number}_kit_{index}" for number in range(3) for index in range(2)] + ["bogus"]


@dataclass(frozen=True)
class Input:
    """An input in a tick: at its border before the step, or in it, before the referee's turn."""

    tick: int
    at_border: bool
    kind: str
    tray: str = TRAY_1
    kit_type: str = ""
    tray_objects: TrayContents = ()
    carrying: bool = False


@st.composite
def orders(draw: st.DrawFn, number: int) -> Order:
    types = tuple(draw(st.lists(st.sampled_from(TYPES), min_size=1, max_size=2)))
    kits = draw(st.sampled_from((0, 1, 1, 1, 2)))
    value = draw(st.integers(0, 2))
    match draw(st.sampled_from(("time", "time", "wanted", "unwanted", "never"))):
        case "time":
            start_time = draw(st.sampled_from((-1.0, 0.0, 0.02, 0.021, 0.06)))
            return order(number, types, kits=kits, start_time=start_time)
        case "wanted":
            return order(number, types, kits=kits, wanted_parts=value)
        case "unwanted":
            return order(number, types, kits=kits, unwanted_parts=value)
        case _:
            return order(number, types, kits=kits)


trials = st.builds(
    lambda count, drawn, limit: Trial("test", orders=drawn[:count], time_limit=limit),
    st.sampled_from((0, 1, 2, 2, 3, 3)),
    st.tuples(orders(0), orders(1), orders(2)),
    st.sampled_from((None, None, None, 0.0, 0.05, 0.051)),
)
inputs = st.builds(
    Input,
    st.integers(2, TICKS),
    st.booleans(),
    st.sampled_from(("tray", "tray", "submit", "submit", "submit", "gripper", "gripper", "end", "start")),
    st.sampled_from((TRAY_1, TRAY_2)),
    st.sampled_from(NAMES),
    contents(max_size=3),
    st.booleans(),
)
stories = st.lists(inputs, max_size=12).map(
    lambda drawn: sorted([Input(1, at_border=True, kind="start"), *drawn], key=lambda each: each.tick)
)
# Ending at random would cut most stories short, so only every eighth keeps its ends.
stories = st.tuples(stories, st.integers(0, 7)).map(
    lambda drawn: drawn[0] if drawn[1] == 0 else [each for each in drawn[0] if each.kind != "end"]
)


def log_of(effects: tuple[Effect, ...], now: int) -> list[LogEntry]:
    log: list[LogEntry] = []
    for effect in effects:
        match effect:
            case StateChanged(state):
                log.append((now, "state", state.value))
            case OrderAnnounced(announced):
                log.append((now, "announced", announced.order_id))
            case OrderCompleted(score):
                log.append((now, "complete", score.order_id))
    return log


class Run:
    """Run of a referee through a story of inputs; `cadence` selects when it is updated."""

    def __init__(self, trial: Trial, cadence: str) -> None:
        self.trial = trial
        self.cadence = cadence
        self.referee = Referee(trial)
        for tray in (TRAY_1, TRAY_2):
            self.referee.tray_changed(tray, ())
        self.log: list[LogEntry] = []
        self.judged: list[bool] = []
        self.effects: list[Effect] = []
        self.calls = 0

    def take(self, effects: tuple[Effect, ...], now: int) -> None:
        self.effects += effects
        self.log += log_of(effects, now)

    def receive(self, each: Input, now: int) -> None:
        try:
            match each.kind:
                case "start":
                    self.take(self.referee.start(now), now)
                case "end":
                    self.take(self.referee.end(now), now)
                case "tray":
                    self.referee.tray_changed(each.tray, each.tray_objects)
                case "gripper":
                    self.referee.scorer.gripper_changed(now, enabled=True, attached=each.carrying)
                case _:
                    submitted = self.referee.submit(each.tray, each.kit_type, now)
                    self.effects.append(submitted)
                    self.judged.append(submitted.score.is_submitted)
        except RejectedCommandError:
            if each.kind == "submit":
                self.judged.append(False)

    def turn(self, now: int) -> None:
        if self.cadence == "deadlines" and now < self.referee.next_deadline:
            return
        self.calls += 1
        self.take(self.referee.update(now), now)
        if self.cadence == "snapshots":
            state = json.loads(json.dumps(self.referee.get_state(), sort_keys=True))
            self.referee = Referee(self.trial)
            self.referee.set_state(state)

    def play(self, story: list[Input]) -> Run:
        for tick in range(1, TICKS + 1):
            for each in story:
                if each.tick == tick and each.at_border:
                    self.receive(each, (tick - 1) * TICK)
            for each in story:
                if each.tick == tick and not each.at_border:
                    self.receive(each, tick * TICK)
            self.turn(tick * TICK)
        return self


def play_naively(trial: Trial, story: list[Input]) -> tuple[NaiveReferee, list[bool]]:
    naive, judged = NaiveReferee(trial, TICK), []
    naive.trays = {TRAY_1: (), TRAY_2: ()}

    def receive(each: Input, now: int) -> None:
        match each.kind:
            case "start" | "end":
                naive.command(each.kind, now)
            case "tray":
                naive.trays[each.tray] = each.tray_objects
            case "gripper":
                naive.carrying = each.carrying
            case _:
                judged.append(naive.submit(each.kit_type))

    for tick in range(1, TICKS + 1):
        for each in story:
            if each.tick == tick and each.at_border:
                receive(each, (tick - 1) * TICK)
        naive.pass_time()
        state = naive.state
        for each in story:
            if each.tick == tick and not each.at_border:
                receive(each, tick * TICK)
        if naive.state == state:  # the effects of a command within this tick follow in the next one
            naive.step(tick * TICK)
    return naive, judged


@pytest.mark.slow
@settings(max_examples=200)
@given(trials, stories)
def test_all_cadences_agree_with_naive_rules(trial: Trial, story: list[Input]) -> None:
    every_tick = Run(trial, "every tick").play(story)
    at_deadlines = Run(trial, "deadlines").play(story)
    with_snapshots = Run(trial, "snapshots").play(story)
    end = TICKS * TICK
    for other in (at_deadlines, with_snapshots):
        assert other.log == every_tick.log
        assert other.effects == every_tick.effects
        assert other.referee.get_state() == every_tick.referee.get_state()
        assert other.referee.score(end) == every_tick.referee.score(end)

    naive, judged = play_naively(trial, story)
    assert every_tick.log == naive.log
    assert every_tick.judged == judged
    score = every_tick.referee.score(end)
    assert {each.order_id: each.time_taken for each in score.orders} == naive.scorer.times
    assert score.part_travel_time == naive.travel


def test_referee_has_few_deadlines() -> None:
    trial = Trial("test", orders=(order(0, start_time=0.02), order(1, start_time=0.06)), time_limit=0.1)
    run = Run(trial, "deadlines").play([Input(1, at_border=True, kind="start")])
    # ready, go and the next step, two announcements, the time limit, done
    assert run.calls <= 6
    assert run.log[-1][2] == "done"
