"""Client registry of the server: admission, buffer shares, and disconnection of misbehaving clients."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from cellwright.middleware.server.client_connection import (
    FULL,
    LATE,
    MOST_WAITING,
    ClientConnection,
    HoldBudget,
    ReasonCounter,
)
from cellwright.middleware.server.requests import refused_frame
from cellwright.middleware.wire.frames import Frame, FrameError, Kind

MOST_GUESTS = 200
"""More connections than these are turned away, those first that have not said who they are; `select` can look at
some 1000."""

PATIENCE = 30.0
"""So long [s] a guest may take nothing of what waits for it, or not say who it is, before it is cut off."""

MOST_BEGUN = 64 << 20
"""So many bytes may be kept of what all guests together have begun to say and not ended; who has most is cut off."""

_MOST_NAMED = 10  # guests that were cut off, in one report
_LOOK_AFTER = 1.0  # [s] of wall time between two looks at who is behind, stuck or silent


class ClientRegistry:
    """Those who are there, in the order in which they came.

    Args:
        report: takes a line about guests that misbehave, at most one a second for each.
        forget: told of each that has gone.
    """

    def __init__(self, report: Callable[[str], None], forget: Callable[[ClientConnection], None]) -> None:
        self._report = report
        self._forget = forget
        self._there: list[ClientConnection] = []
        self._cut_off: dict[str, ReasonCounter] = {}
        self._waited_for: set[str] = set()
        self._looked = time.monotonic()
        self._standing_time = HoldBudget(self._looked)

    def __iter__(self) -> Iterator[ClientConnection]:
        return iter(self._there)

    def __len__(self) -> int:
        return len(self._there)

    def from_turn(self, turn: int) -> list[ClientConnection]:
        """All of them once, beginning with the one whose turn it is."""
        first = turn % len(self._there) if self._there else 0
        return [*self._there[first:], *self._there[:first]]

    def admit(self, guest: ClientConnection) -> None:
        """Take one in; if there are too many, another may have to go for it."""
        self._there.append(guest)
        self._share_room()
        if len(self._there) > MOST_GUESTS:
            # who has not said who it is makes room: a crowd that says nothing must not keep programs out
            silent = next((each for each in self._there if not each.node and not each.is_leaving), guest)
            self.cut(silent, FrameError(f"there are {MOST_GUESTS} guests already"))

    def cut(self, guest: ClientConnection, error: FrameError) -> None:
        """Tell a guest why nothing more is heard from it; it leaves once it has been told."""
        guest.say(refused_frame(0, error))
        guest.stop_hearing()
        self._note_cut(guest, str(error))

    def forget_those_gone(self) -> None:
        """Let go of those to whom nothing more can be said; the others share their room."""
        for guest in [guest for guest in self._there if guest.is_gone]:
            self._there.remove(guest)
            self._forget(guest)
            guest.close()
        self._share_room()

    def close(self) -> None:
        """Let go of all of them."""
        self._tell_who_was_cut_off()
        for guest in self._there:
            guest.close()
        self._there.clear()

    def _share_room(self) -> None:
        """Give each guest its part of what may wait for all."""
        for guest in self._there:
            guest.full = min(FULL, MOST_WAITING // len(self._there))

    def ping(self) -> None:
        """Send the PINGs that are due."""
        now = time.monotonic()
        for guest in self._there:
            if guest.heartbeat is not None and not guest.is_leaving and (number := guest.heartbeat.ping(now)):
                guest.say(Frame(Kind.PING, number))

    def hold_time(self) -> bool:
        """Whether simulation time stands for guests that are behind; the first time that it does is reported."""
        now = time.monotonic()
        late = [guest for guest in self._there if guest.heartbeat is not None and guest.heartbeat.is_late(now)]
        late = [guest for guest in late if not guest.is_leaving and not guest.is_gone]
        if not self._standing_time.may_stand(now, is_wanted=bool(late)):
            return False
        for guest in late:
            if guest.name not in self._waited_for and len(self._waited_for) < _MOST_NAMED:
                self._waited_for.add(guest.name)
                self._report(f"time stands while {guest.name} is more than {LATE:g} s behind; this is said once")
        return True

    def limit_what_is_begun(self) -> None:
        """Part with whoever has begun most and not ended it, until it is little enough for all together."""
        while sum(guest.begun for guest in self._there) > MOST_BEGUN:
            greatest = max(self._there, key=lambda guest: guest.begun)
            self.cut(greatest, FrameError("all guests together have begun too much and not ended it"))

    @property
    def next_look(self) -> float:
        """How long it is [s] until they are to be looked after again."""
        return max(0.0, self._looked + _LOOK_AFTER - time.monotonic())

    def look_after(self) -> None:
        """Once a second: say what happened to guests, and part with those that are hopeless."""
        now = time.monotonic()
        if now - self._looked < _LOOK_AFTER:
            return
        self._looked = now
        for guest in self._there:
            if guest.dropped:
                self._report(f"{guest.name} does not read as fast as it is told: {guest.dropped} messages were dropped")
                guest.dropped = 0
            if guest.untold:
                self._report(f"{guest.name} cannot be told: {guest.untold.take()}")
            is_stuck = guest.stuck_since is not None and now - guest.stuck_since > PATIENCE
            if is_stuck and (guest.is_behind or guest.is_leaving):
                guest.is_gone = True
                self._note_cut(guest, f"it has read nothing for {PATIENCE:g} s")
            elif not guest.node and not guest.is_leaving and now - guest.came > PATIENCE:
                self.cut(guest, FrameError(f"it has not said who it is for {PATIENCE:g} s"))
        self._tell_who_was_cut_off()

    def _tell_who_was_cut_off(self) -> None:
        for name, reasons in self._cut_off.items():
            self._report(f"cut off {name}: {reasons.take()}")
        self._cut_off.clear()

    def _note_cut(self, guest: ClientConnection, reason: str) -> None:
        """Take note of it for the next report; names come from outside, and beyond some the others share a line."""
        name = guest.name if guest.name in self._cut_off or len(self._cut_off) < _MOST_NAMED else "others"
        self._cut_off.setdefault(name, ReasonCounter()).add(reason)
