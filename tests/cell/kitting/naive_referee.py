"""Reference implementation of the competition's rules, step by step at every tick, without deadlines."""

from __future__ import annotations

from cellwright.cell.kitting.inventory import TrayContents
from cellwright.config.trial.trial import Order, Trial

LogEntry = tuple[int, str, str]


class NaiveScorer:
    """Stack of the orders in progress, the submitted kits and the time of each announced order."""

    def __init__(self) -> None:
        self.stack: list[Order] = []
        self.announced: list[Order] = []
        self.submitted: set[str] = set()
        self.times: dict[str, int] = {}

    def announce(self, order: Order) -> None:
        self.stack.append(order)
        self.announced.append(order)
        self.times[order.order_id] = 0

    def withdraw(self, order_id: str) -> bool:
        """Take the newest order away; return False, and take none, if the named one is not in progress."""
        if not any(each.order_id == order_id for each in self.stack):
            return False
        self.stack.pop()
        return True

    def submit(self, kit_type: str) -> bool:
        """Return True if a tray is judged as this kit, now or before."""
        if any(kit.kit_type == kit_type for order in self.stack for kit in order.kits):
            self.submitted.add(kit_type)
            return True
        return False

    def complete(self, order: Order) -> bool:
        return all(kit.kit_type in self.submitted for kit in order.kits)

    def points(self, order_id: str) -> int:
        """Return the number of submitted kits of an order."""
        return sum(
            kit.kit_type in self.submitted for each in self.announced if each.order_id == order_id for kit in each.kits
        )

    def pass_time(self, tick: int) -> None:
        for order in self.announced:
            self.times[order.order_id] += 0 if self.complete(order) else tick


class NaiveReferee:
    """Log of events as (time, kind, name), made at every step; accumulates times tick by tick."""

    def __init__(self, trial: Trial, tick: int) -> None:
        self.limit = trial.time_limit
        self.tick = tick
        timed = [
            (each.start_time, place, each) for place, each in enumerate(trial.orders) if each.start_time is not None
        ]
        self.to_come = [each for *_, each in sorted(timed, key=lambda entry: entry[:2])]
        self.to_come += [each for each in trial.orders if each.start_time is None]
        self.scorer = NaiveScorer()
        self.trays: dict[str, TrayContents] = {}
        self.state = "init"
        self.elapsed = 0
        self.travel = 0
        self.carrying = False
        self.log: list[LogEntry] = []

    def command(self, word: str, now: int) -> None:
        if word == "start" and self.state == "init":
            self.enter("ready", now)
        elif word == "end" and self.state != "end_game":
            self.enter("end_game", now)

    def submit(self, kit_type: str) -> bool:
        """Return True if a tray is judged as this kit, now or before."""
        return self.state == "go" and self.scorer.submit(kit_type)

    def pass_time(self) -> None:
        """Let one tick pass."""
        if self.state == "go":
            self.elapsed += self.tick
            self.travel += self.tick if self.carrying else 0
            self.scorer.pass_time(self.tick)

    def step(self, now: int) -> None:
        if self.state == "ready":
            self.enter("go", now)
        elif self.state == "end_game":
            self.enter("done", now)
        elif self.state == "go" and self.limit is not None and self.limit * 10**9 < self.elapsed:
            self.enter("end_game", now)
        elif self.state == "go":
            if self.to_come and self.is_due(self.to_come[0]):
                order = self.to_come.pop(0)
                self.scorer.announce(order)
                self.log.append((now, "announced", order.order_id))
            stack = self.scorer.stack
            if stack and self.scorer.complete(stack[-1]):
                self.log.append((now, "complete", stack[-1].order_id))
                self.scorer.withdraw(stack[-1].order_id)
            if not stack and not self.to_come:
                self.enter("end_game", now)

    def is_due(self, order: Order) -> bool:
        if order.start_time is not None:
            return self.elapsed >= order.start_time * 10**9
        wanted_limit, unwanted_limit = order.wanted_parts or 0, order.unwanted_parts or 0
        if max(wanted_limit, unwanted_limit) <= 0:
            return False
        if not self.scorer.stack:
            return True
        counts = [self.count(order, each) for each in self.trays.values()]
        max_wanted, max_unwanted = max(wanted for wanted, _ in counts), max(unwanted for _, unwanted in counts)
        return 0 < wanted_limit <= max_wanted or 0 < unwanted_limit <= max_unwanted

    def count(self, order: Order, contents: TrayContents) -> tuple[int, int]:
        needed = [each.type for kit in order.kits for each in kit.objects]
        unwanted = 0
        for each in contents:
            if each.is_faulty:
                continue
            if each.type in needed:
                needed.remove(each.type)
            else:
                unwanted += 1
        return sum(len(kit.objects) for kit in order.kits) - len(needed), unwanted

    def enter(self, state: str, now: int) -> None:
        self.state = state
        self.log.append((now, "state", state))
