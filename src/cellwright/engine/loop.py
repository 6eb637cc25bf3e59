"""The loop that steps a simulation: by the wall clock, as fast as it goes, or in lockstep when a client asks."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from cellwright.engine.clock import NEVER
from cellwright.engine.rate_control import RateControl, RealTimePacer
from cellwright.engine.simulation import Simulation
from cellwright.util.errors import RunEndedError

_POLL = 0.1  # [s] of wall time
_NAP = 0.01  # [s] of wall time: while time stands, a change of the rate is noticed this soon
_SERVE_AFTER = 0.001  # [s] of wall time: clients are served this often even when there is no time to wait
_FOREVER = float("inf")


class StopCondition:
    """When a run stops: at a simulation time, or on request.

    Example:
        >>> stop = StopCondition(5_000_000_000)
        >>> stop.limit(2_000_000_000, "the competition is done")
        >>> stop.deadline, stop.reason
        (2000000000, 'the competition is done')
        >>> stop.request()
        >>> stop.deadline, stop.reason
        (0, 'stopped on request')

    Args:
        deadline: simulation time [ns] past which no time passes; None: there is none.
        reason: the text of the error for a client that asks for more time then.
    """

    def __init__(self, deadline: int | None = None, reason: str = "the run is over") -> None:
        self._initial = NEVER if deadline is None else deadline, reason
        self._limit = self._initial
        self.deadline, self.reason = self._initial  # plain attributes: read once a tick
        self.is_requested = False
        """Whether the run is to stop before the next tick, whatever the time."""

    def request(self, reason: str = "stopped on request") -> None:
        """Stop before the next tick; from any thread, a signal handler included."""
        self.is_requested = True
        self.deadline, self.reason = 0, reason

    def withdraw(self) -> None:
        """Take back a request; limits hold."""
        self.is_requested = False
        self.deadline, self.reason = self._limit

    def limit(self, time: int, reason: str = "the run is over") -> None:
        """Stop at a simulation time [ns] too; an earlier limit holds."""
        if time < self._limit[0]:
            self._limit = time, reason
            if not self.is_requested:
                self.deadline, self.reason = self._limit

    def reset(self) -> None:
        """Go back to the limit of the start, for a run that begins again; a request holds."""
        self._limit = self._initial
        if not self.is_requested:
            self.deadline, self.reason = self._limit


class ClientService(Protocol):
    """What the loop needs of a server of clients."""

    @property
    def lockstep(self) -> bool:
        """Whether time passes on request of clients, and not otherwise."""

    @property
    def asked(self) -> Any:
        """In lockstep: the request whose turn it is (`until` [ns], `each_tick`, `guest`); None where there is none."""

    @property
    def is_anybody_behind(self) -> bool:
        """Whether a client has to read first, if nothing is to be lost."""

    def wait(self, seconds: float, *, until_asked: bool = True) -> None:
        """Serve clients for so long [s] of wall time."""

    def hold_time(self) -> bool:
        """Whether time stands for a client that is behind."""

    def answer(self, asked: Any, refused: BaseException | None = None) -> None:
        """Answer a request: with the time, or with an error."""


@dataclass(frozen=True)
class Pace:
    """How time kept to the wall clock."""

    factor: float
    """Simulated seconds a wall second, on average."""
    worst_lateness: float
    """How late [s] of wall time the latest tick came."""
    stood: float = 0.0
    """So long [s] of wall time it stood for clients that were behind."""


class Loop:
    """Steps a simulation, and serves clients meanwhile, also while time stands.

    In lockstep a client that asks is given time up to the moment that it names, or to the tick in which it is sent
    something. Requests of several clients are met one after another, in the order in which they came. A request names a
    moment, not a duration: two clients that wait for the same moment make time pass once.

    Args:
        simulation: what is stepped.
        service: serves the clients; None where there are none.
        rate: how time passes: a rate control, or a speed that stays, in simulated seconds a wall second; None: as fast
            as it goes.
        stop: when it ends; None: on request.
        on_poll: called about ten times a second of wall time.
        patience: in lockstep, how long [s] of wall time to go on serving past the deadline: a client that asks for
            more time gets an error, and may still ask for other things.
        can_stand: whether time may stand while a client is behind; not where a real robot moves on.
    """

    def __init__(
        self,
        simulation: Simulation,
        service: ClientService | None = None,
        *,
        rate: float | RateControl | None = 1.0,
        stop: StopCondition | None = None,
        on_poll: Callable[[], None] = lambda: None,
        patience: float = 0.0,
        can_stand: bool = True,
    ) -> None:
        self._simulation = simulation
        self._service = service
        self._on_poll = on_poll
        self.patience = patience
        self._can_stand = can_stand
        self._polled = self._served = 0.0
        self.stop = stop or StopCondition()
        """When it ends."""
        self.rate = rate if isinstance(rate, RateControl) else RateControl(rate)
        """How time passes."""
        self.pacer = RealTimePacer(simulation, self.rate, sleep=self._serve)

    @property
    def pace(self) -> Pace | None:
        """How time kept to the wall clock so far; None where it did not have to."""
        if self.rate.speed is None or (self._service is not None and self._service.lockstep):
            return None
        return Pace(self.pacer.factor, self.pacer.worst, self.pacer.stood)

    def run(self) -> None:
        """Let time pass until it is to stop.

        Raises:
            SimulationError: the state has become unstable.
        """
        if self._service is not None and self._service.lockstep:
            self._pass_on_request(self._service)
            return
        clock, stop = self._simulation.clock, self.stop
        while clock.now < stop.deadline:
            self._simulation.is_paced = self.rate.speed is not None
            self.tick()

    def tick(self) -> bool:
        """Let one tick pass when the rate control does, and serve clients until then; False when it is to stop instead.

        Raises:
            SimulationError: the state has become unstable.
        """
        if not self._wait_for_the_rate() or not self._wait_for_clients():
            return False
        self.pacer.step()
        self._look_around()
        return True

    def _wait_for_clients(self) -> bool:
        """Serve clients while time stands for one that is behind; False when it is to stop."""
        service = self._service
        if service is None or not self._can_stand or self.rate.speed is None or not service.hold_time():
            return True
        begun = time.perf_counter()
        while not self.stop.is_requested and service.hold_time():
            self._serve(_NAP, until_asked=False)
            self._look_around()
        self.pacer.stand(time.perf_counter() - begun)
        return not self.stop.is_requested

    def _wait_for_the_rate(self) -> bool:
        """Serve clients while time stands; False when it is to stop."""
        while not (self.stop.is_requested or self.rate.take()):
            self._serve(_NAP, until_asked=False)
            self._look_around()
        return not self.stop.is_requested

    def _pass_on_request(self, service: ClientService) -> None:
        clock, stop, end = self._simulation.clock, self.stop, _FOREVER
        while not stop.is_requested and time.perf_counter() < end:
            is_over = clock.now >= stop.deadline
            if is_over and end == _FOREVER:
                end = time.perf_counter() + self.patience
                continue
            asked = service.asked
            if asked is None:
                self._serve(_POLL / 2)
            elif is_over and asked.until > clock.now:
                service.answer(asked, RunEndedError(stop.reason))
            else:
                self._grant(service, asked)
            self._look_around()

    def _grant(self, service: ClientService, asked: Any) -> None:
        """Let time pass as a client asked for; not at all if it is gone."""
        clock, stop = self._simulation.clock, self.stop
        while clock.now < asked.until and clock.now < stop.deadline:
            while service.is_anybody_behind and not stop.is_requested:
                self._serve(_POLL / 2)  # nothing is lost in lockstep: who is behind has to read first
            if asked.guest.is_gone or not self._wait_for_the_rate() or asked.guest.is_gone:
                return
            self.pacer.step()
            if asked.each_tick or asked.guest.has_news:
                break
            self._look_around()
        service.answer(asked)

    def _look_around(self) -> None:
        """Serve and poll, where that was not done a moment ago."""
        now = time.perf_counter()
        if now - self._served > _SERVE_AFTER:
            self._serve(0.0)
        if now - self._polled > _POLL:
            self._polled = now
            self._on_poll()

    def _serve(self, seconds: float, *, until_asked: bool = True) -> None:
        if self._service is not None:
            self._service.wait(seconds, until_asked=until_asked)
        elif seconds > 0.0:
            time.sleep(seconds)
        self._served = time.perf_counter()
