"""Lets time pass while guests are served: by the wall clock, as fast as it goes, or in lockstep when a guest asks.

How it passes says a tempo, which may change at any moment; while it lets time stand, guests are served all the same.

In lockstep a guest that asks is given time up to the moment that it names, or to the tick in which it is told
something. With several guests each may ask; their wishes are met one after another, in the order in which they came.
A wish names a moment, not a duration: two guests that wait for the same moment make time pass once.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from cellwright.engine.rate_control import RateControl, RealTimePacer
from cellwright.middleware.bus import Served
from cellwright.middleware.server.requests import AdvanceRequest
from cellwright.middleware.server.server import Server
from cellwright.util.errors import RunEndedError

_POLL = 0.1  # [s] of wall time
_NAP = 0.01  # [s] of wall time: while time stands, so soon it goes on when somebody says so
_SERVE_AFTER = 0.001  # [s] of wall time: so often guests are served even when there is no time to wait
_NEVER = float("inf")


class Timekeeper:
    """Lets the time of what is served pass.

    Args:
        served: whose time it is.
        server: serves its guests meanwhile.
        tempo: how time is to pass: a `Tempo`, or a speed that stays, in simulated seconds a wall second; None: as fast
            as it goes.
        on_poll: called about ten times a second of wall time.
        patience: in lockstep, how long [s] of wall time to go on serving when there is no more time to be had: who
            asks for some is told so, and may still ask for other things.
        can_stand: whether time may stand while a guest is behind; not where a real robot moves on.
    """

    def __init__(
        self,
        served: Served,
        server: Server,
        *,
        tempo: float | RateControl | None = 1.0,
        on_poll: Callable[[], None] = lambda: None,
        patience: float = 0.0,
        can_stand: bool = True,
    ) -> None:
        self._simulation = served.simulation
        self._server = server
        self._on_poll = on_poll
        self._patience = patience
        self._can_stand = can_stand
        self._polled = self._served = 0.0
        self.is_stopped = False
        """Set it, from anywhere, to have `run` end before the next tick."""
        self.tempo = tempo if isinstance(tempo, RateControl) else RateControl(tempo)
        """How time is to pass."""
        self.pacer = RealTimePacer(self._simulation, self.tempo, sleep=self._serve)

    def run(self, deadline: Callable[[], float], reason: Callable[[], str] = lambda: "time is over") -> None:
        """Let time pass up to the deadline [ns], which may move, or until it is stopped.

        Args:
            deadline: tells when time is over [ns].
            reason: why it is, for guests that ask for more.

        Raises:
            SimulationError: the state has become unstable.
        """
        if self._server.lockstep:
            self._pass_on_request(deadline, reason)
            return
        clock = self._simulation.clock
        while not self.is_stopped and clock.now < deadline():
            self._simulation.is_paced = self.tempo.speed is not None
            self.tick()

    def tick(self) -> bool:
        """Let one tick pass when the tempo does, and serve guests until then; False when it is stopped instead.

        Raises:
            SimulationError: the state has become unstable.
        """
        if not self._wait_for_the_tempo():
            return False
        if self._can_stand and self.tempo.speed is not None and not self._wait_for_guests():
            return False
        self.pacer.step()
        self._look_around()
        return True

    def _wait_for_guests(self) -> bool:
        """Serve guests while time stands for one that is behind; False when it is stopped."""
        if not self._server.hold_time():
            return True
        begun = time.perf_counter()
        while not self.is_stopped and self._server.hold_time():
            self._serve(_NAP, until_asked=False)
            self._look_around()
        self.pacer.stand(time.perf_counter() - begun)
        return not self.is_stopped

    def _wait_for_the_tempo(self) -> bool:
        """Serve guests while time stands; False when it is stopped."""
        while not (self.is_stopped or self.tempo.take()):
            self._serve(_NAP, until_asked=False)
            self._look_around()
        return not self.is_stopped

    def _pass_on_request(self, deadline: Callable[[], float], reason: Callable[[], str]) -> None:
        clock, end = self._simulation.clock, _NEVER
        while not self.is_stopped and time.perf_counter() < end:
            is_over = clock.now >= deadline()
            if is_over and end == _NEVER:
                end = time.perf_counter() + self._patience
                continue
            asked = self._server.asked
            if asked is None:
                self._serve(_POLL / 2)
            elif is_over and asked.until > clock.now:
                self._server.answer(asked, RunEndedError(reason()))
            else:
                self._grant(asked, deadline)
            self._look_around()

    def _grant(self, asked: AdvanceRequest, deadline: Callable[[], float]) -> None:
        """Let time pass as a guest asked for; not at all if it is gone."""
        clock = self._simulation.clock
        while clock.now < asked.until and clock.now < deadline():
            while self._server.is_anybody_behind and not self.is_stopped:
                self._serve(_POLL / 2)  # nothing is lost in lockstep: who is behind has to read first
            if asked.guest.is_gone or not self._wait_for_the_tempo() or asked.guest.is_gone:
                return
            self.pacer.step()
            if asked.each_tick or asked.guest.has_news:
                break
            self._look_around()
        self._server.answer(asked)

    def _look_around(self) -> None:
        """Serve and poll, where that was not done a moment ago."""
        now = time.perf_counter()
        if now - self._served > _SERVE_AFTER:
            self._serve(0.0)
        if now - self._polled > _POLL:
            self._polled = now
            self._on_poll()

    def _serve(self, seconds: float, *, until_asked: bool = True) -> None:
        self._server.wait(seconds, until_asked=until_asked)
        self._served = time.perf_counter()
