"""Referee: the state machine of the competition, and the announcement of its orders.

    init --start--> ready --next step--> go --orders done, time limit--> end_game --next step--> done
                                    (end, from any state, --> end_game)

A step is a call of `update` that changes something: one announcement, one closed order, one change of state. Two steps
never happen at the same time.

Between inputs nothing happens before `next_deadline`. A caller may call `update` at every tick, or only when `now >=
referee.next_deadline`: effects and state are the same.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from cellwright.cell.kitting.effects import (
    AnnouncementReason,
    CompetitionState,
    ConveyorPower,
    Effect,
    EndReason,
    KitSubmitted,
    OrderAnnounced,
    OrderCompleted,
    PopulationRestart,
    StateChanged,
    TrialEnded,
)
from cellwright.cell.kitting.inventory import TrayContents, TrayObject, contents_from_json, contents_to_json
from cellwright.cell.kitting.scorer import GameScore, Scorer
from cellwright.config.trial.trial import Order, Trial
from cellwright.engine.clock import NEVER, nanoseconds
from cellwright.util.errors import RejectedCommandError, UnknownNameError

NOW = -NEVER
"""A time [ns] before any other: due immediately."""

FULL_POWER = 100.0
"""Power of the conveyor during a competition [%]."""


class Announcements:
    """The orders of a trial, sorted by start time, some of which have been announced.

    Orders without a start time come after those with one; equals stay in the order of the file. Only the first waiting
    order is examined, so an order behind a conditional one waits for it.
    """

    def __init__(self, orders: Iterable[Order]) -> None:
        self.orders = tuple(
            sorted(orders, key=lambda order: math.inf if order.start_time is None else order.start_time)
        )
        self.announced = 0

    @property
    def waiting(self) -> tuple[Order, ...]:
        """The orders still to be announced, the next one first."""
        return self.orders[self.announced :]

    def due(self, trays: Iterable[TrayContents], *, idle: bool) -> tuple[int, AnnouncementReason] | None:
        """Return the due time [ns after the start] of the next order, and the reason for its announcement.

        Args:
            trays: present contents of all trays.
            idle: True if no order is in progress.

        Returns:
            None if only a change of the trays can make the order due.
        """
        if self.announced == len(self.orders):
            return None
        order = self.orders[self.announced]
        if order.start_time is not None:
            return (min(nanoseconds(order.start_time), NEVER), AnnouncementReason.TIME)
        wanted_limit, unwanted_limit = order.wanted_parts or 0, order.unwanted_parts or 0
        if wanted_limit <= 0 and unwanted_limit <= 0:
            return None
        if idle:
            return (NOW, AnnouncementReason.IDLE)
        counts = [count_parts(order, contents) for contents in trays]
        if wanted_limit > 0 and any(wanted >= wanted_limit for wanted, _ in counts):
            return (NOW, AnnouncementReason.WANTED_PARTS)
        if unwanted_limit > 0 and any(unwanted >= unwanted_limit for _, unwanted in counts):
            return (NOW, AnnouncementReason.UNWANTED_PARTS)
        return None

    def announce(self) -> Order:
        """Mark the next order as announced and return it; there must be one."""
        self.announced += 1
        return self.orders[self.announced - 1]


def count_parts(order: Order, contents: TrayContents) -> tuple[int, int]:
    """Count the good parts on a tray that the order can use, and those that it cannot.

    Each ordered part, over all kits of the order, is used once. Faulty parts count on neither side.
    """
    ordered = Counter(each.type for kit in order.kits for each in kit.objects)
    good = Counter(each.type for each in contents if not each.is_faulty)
    usable = (ordered & good).total()
    return usable, good.total() - usable


class Referee:
    """Referee of one trial: announces orders, judges trays, watches the time limit and ends the game.

    Each call returns the effects that it causes, in the order in which the caller must carry them out. All times `now`
    are in ns and never decrease.
    """

    def __init__(self, trial: Trial) -> None:
        limit = trial.time_limit
        self._time_limit = None if limit is None else nanoseconds(limit)
        self.scorer = Scorer(trial.orders)
        self.trays: dict[str, TrayContents] = {}
        """The latest report of each tray."""
        self._announcements = Announcements(trial.orders)
        # a task without orders ends by its success or its time limit
        self._needs_order = trial.task is None or bool(trial.orders)
        self.state = CompetitionState.INIT
        self._stepped = -1
        self._started: int | None = None
        self._ended: int | None = None
        self.end_reason: EndReason | None = None
        """Reason for the end of the game; None before the end."""
        self._is_reported = False
        self.next_deadline = NEVER
        """Time [ns] from which `update` is due, or `NEVER`. An input may make it earlier."""
        self._blank = self.get_state()

    @property
    def active_orders(self) -> list[str]:
        """Ids of the orders in progress: the last is active, the others are interrupted."""
        return self.scorer.in_progress

    def score(self, now: int) -> GameScore:
        """Return the score at this time."""
        return self.scorer.game_score(now)

    def process_time(self, now: int) -> int:
        """Return the time since the start [ns]; it stops with the end of the game."""
        if self._started is None:
            return 0
        return (now if self._ended is None else self._ended) - self._started

    def start(self, now: int) -> tuple[Effect, ...]:
        """Start the competition.

        Raises:
            RejectedCommandError: it was started or ended before.
        """
        if self.state is not CompetitionState.INIT:
            raise RejectedCommandError(f"a competition starts in state 'init' only (got '{self.state!s}')")
        return self._enter(CompetitionState.READY, now)

    def end(self, now: int) -> tuple[Effect, ...]:
        """End the competition, in any state."""
        if self.state is CompetitionState.END_GAME:
            return ()
        return self._finish(EndReason.COMMAND, now)

    def tray_changed(self, tray_id: str, contents: Iterable[TrayObject]) -> None:
        """Record a tray's report. Report empty trays at the start, so that they are known."""
        self.trays[tray_id] = tuple(contents)
        self._plan()

    def submit(self, tray_id: str, kit_type: str, now: int) -> KitSubmitted:
        """Judge the latest report of a tray as a kit.

        A kit that no order in progress asks for scores 0. `score.refusal` then has the reason, and callers should log
        it clearly.

        Raises:
            RejectedCommandError: the competition is not running.
            UnknownNameError: there is no such tray.
        """
        if self.state is not CompetitionState.GO:
            raise RejectedCommandError(f"kits are judged in state 'go' only (got '{self.state!s}')")
        if tray_id not in self.trays:
            raise UnknownNameError("tray", tray_id, self.trays)
        is_repeated = self.scorer.is_submitted(kit_type)
        score = self.scorer.submit(kit_type, self.trays[tray_id], now, tray_id.partition("::")[0])
        self._plan()
        return KitSubmitted(tray_id, kit_type, score, is_repeated=is_repeated and score.is_submitted)

    def update(self, now: int) -> tuple[Effect, ...]:
        """Take a step if one is due: not before `next_deadline`, and not at the time of the previous step."""
        if now < self.next_deadline:
            return ()
        self._stepped = now
        match self.state:
            case CompetitionState.READY:
                self._started = now
                self.scorer.begin(now)
                effects = (*self._enter(CompetitionState.GO, now), ConveyorPower(FULL_POWER), PopulationRestart())
            case CompetitionState.GO:
                effects = self._play(now)
            case CompetitionState.END_GAME:
                effects = self._conclude(now)
            case _:
                effects = ()
        self._plan()
        return effects

    def _play(self, now: int) -> tuple[Effect, ...]:
        elapsed = self.process_time(now)
        if self._time_limit is not None and elapsed > self._time_limit:
            return self._finish(EndReason.TIME_LIMIT, now)
        effects: tuple[Effect, ...] = ()
        due = self._announcements.due(self.trays.values(), idle=not self.active_orders)
        if due is not None and elapsed >= due[0]:
            order = self._announcements.announce()
            effects += (OrderAnnounced(order, due[1], interrupts=self._top()),)
            self.scorer.announce(order.order_id, now)
        top = self._top()
        if top is not None and self.scorer.is_complete(top):
            score = self.scorer.withdraw(top, now)
            effects += (OrderCompleted(score, resumes=self._top()),)
        if self._needs_order and not self.active_orders and not self._announcements.waiting:
            reason = EndReason.ORDERS_COMPLETE if self._announcements.orders else EndReason.NO_ORDERS
            effects += self._finish(reason, now)
        return effects

    def _conclude(self, now: int) -> tuple[Effect, ...]:
        effects = self._enter(CompetitionState.DONE, now)
        # a second end after the report changes nothing
        if self.end_reason is None or self._is_reported:
            return effects
        self._is_reported = True
        return (*effects, TrialEnded(self.end_reason, self.score(now), self.process_time(now)))

    def reset(self) -> None:
        """Start a new run of the same trial, in the initial state and without trays."""
        self.set_state(self._blank)

    def get_state(self) -> dict[str, Any]:
        """Return the whole state as JSON values."""
        return {
            "state": self.state.value,
            "stepped": self._stepped,
            "started": self._started,
            "ended": self._ended,
            "end_reason": None if self.end_reason is None else self.end_reason.value,
            "reported": self._is_reported,
            "announced": self._announcements.announced,
            "active": list(self.active_orders),
            "trays": {tray_id: contents_to_json(contents) for tray_id, contents in self.trays.items()},
            "scorer": self.scorer.get_state(),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore the state that `get_state` returned from a referee of the same trial.

        Raises:
            UnknownNameError: it names an order or a kit that this trial does not have.
        """
        self.scorer.set_state(state["scorer"])
        self.trays = {tray_id: contents_from_json(contents) for tray_id, contents in state["trays"].items()}
        self._announcements.announced = state["announced"]
        self.state = CompetitionState(state["state"])
        self._stepped = state["stepped"]
        self._started = state["started"]
        self._ended = state["ended"]
        self.end_reason = None if state["end_reason"] is None else EndReason(state["end_reason"])
        self._is_reported = state["reported"]
        self._plan()

    def _top(self) -> str | None:
        return self.active_orders[-1] if self.active_orders else None

    def _enter(self, state: CompetitionState, now: int) -> tuple[Effect, ...]:
        # A command counts as a step, so that its consequences happen at a later time.
        self.state = state
        self._stepped = now
        self._plan()
        return (StateChanged(state),)

    def _finish(self, reason: EndReason, now: int) -> tuple[Effect, ...]:
        if self._ended is None:
            self._ended = now
            self.end_reason = reason
            self.scorer.end(now)
        return self._enter(CompetitionState.END_GAME, now)

    def _plan(self) -> None:
        self.next_deadline = max(self._due(), self._stepped + 1)

    def _due(self) -> int:
        """Return the time of the next step that has something to do [ns]."""
        if self.state in (CompetitionState.READY, CompetitionState.END_GAME):
            return NOW
        if self.state is not CompetitionState.GO or self._started is None:
            return NEVER
        top = self._top()
        is_over = self._needs_order and not self._announcements.waiting
        if self.scorer.is_complete(top) if top is not None else is_over:
            return NOW
        due = self._announcements.due(self.trays.values(), idle=top is None)
        announcement = NEVER if due is None else self._started + due[0]
        limit = NEVER if self._time_limit is None else self._started + self._time_limit + 1
        return min(announcement, limit, NEVER)
