"""Simulation loop: at a rate of the wall clock, as fast as possible, or in lockstep on request of clients."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from cellwright.engine.clock import NEVER
from cellwright.engine.rate_control import RateControl, RealTimePacer
from cellwright.engine.simulation import Simulation
from cellwright.util.errors import RunEndedError

_POLL = 0.1  # [s] of wall time
_NAP = 0.01  # [s] of wall time: while time stands, a change of the rate takes effect this soon
_SERVE_AFTER = 0.001  # [s] of wall time: clients are served this often even when there is no time to wait
_SERVE_IDLE_AFTER = 0.008  # [s] of wall time: and at least this often while none of them does anything
_FOREVER = float("inf")


class StopCondition:
    """Stop condition of a run: a simulation time, or a request.

    Example:
        >>> stop = StopCondition(5_000_000_000)
        >>> stop.limit(2_000_000_000, "the competition is done")
        >>> stop.deadline, stop.reason
        (2000000000, 'the competition is done')
        >>> stop.request()
        >>> stop.deadline, stop.reason
        (0, 'stopped on request')

    Args:
        deadline: simulation time [ns] at which the run ends; None: no deadline.
        reason: text of the error for a client that requests more time then.
    """

    def __init__(self, deadline: int | None = None, reason: str = "the run is over") -> None:
        self._initial = NEVER if deadline is None else deadline, reason
        self._limit = self._initial
        # plain attributes: read once a tick
        self.deadline, self.reason = self._initial
        self.is_requested = False
        """True if the run must stop before the next tick, at any time."""

    def request(self, reason: str = "stopped on request") -> None:
        """Stop before the next tick. Safe to call from any thread, and from a signal handler."""
        self.is_requested = True
        self.deadline, self.reason = 0, reason

    def withdraw(self) -> None:
        """Withdraw a request; limits stay."""
        self.is_requested = False
        self.deadline, self.reason = self._limit

    def limit(self, time: int, reason: str = "the run is over") -> None:
        """Stop at a simulation time [ns] too; an earlier limit stays."""
        if time < self._limit[0]:
            self._limit = time, reason
            if not self.is_requested:
                self.deadline, self.reason = self._limit

    def reset(self) -> None:
        """Restore the initial limit, for a run that starts again; a request stays."""
        self._limit = self._initial
        if not self.is_requested:
            self.deadline, self.reason = self._limit


class ClientService(Protocol):
    """Service of a server that the loop needs."""

    @property
    def lockstep(self) -> bool:
        """True if time advances only on request of clients."""

    @property
    def advance_request(self) -> Any:
        """In lockstep, the request that is served now, None for none.

        It has `until` [ns] in message time, `each_tick`, and its client.
        """

    @property
    def is_client_behind(self) -> bool:
        """True if a client has to read first so that no message is lost."""

    def wait(self, seconds: float, *, until_request: bool = True) -> bool:
        """Serve clients for a duration [s] of wall time; return True if there was anything to do."""

    def hold_time(self) -> bool:
        """Return True if time stands for a client that is behind."""

    def answer(self, request: Any, refused: BaseException | None = None) -> None:
        """Answer a request: with the time, or with an error."""


@dataclass(frozen=True)
class PaceFigures:
    """Pace of a run, compared with the wall clock."""

    factor: float
    """Average real-time factor: simulated seconds in a second of wall time."""
    worst_lateness: float
    """Largest lateness of a tick [s] of wall time."""
    held: float = 0.0
    """Total wall time [s] for which time stood for clients that were behind."""


class SimulationLoop:
    """Loop that steps a simulation and serves clients, also while time stands.

    In lockstep, time advances up to the time that a client requests, or to the tick in which a message is sent to it.
    Requests of several clients are served one after another, in the order of arrival. A request names a time, not a
    duration: if two clients wait for the same time, it passes once.

    Args:
        simulation: the simulation to step.
        service: serves the clients; None without clients.
        rate: a rate control, or a constant speed in simulated seconds a wall second; None: as fast as possible.
        stop: stop condition; None: on request only.
        on_poll: called about ten times a second of wall time.
        timeout: in lockstep, time [s] of wall time to go on serving past the deadline. A client that requests more
            time then gets an error, and may still make other requests.
        can_wait: True if time may stand while a client is behind; False for a real robot, which moves on.
    """

    def __init__(
        self,
        simulation: Simulation,
        service: ClientService | None = None,
        *,
        rate: float | RateControl | None = 1.0,
        stop: StopCondition | None = None,
        on_poll: Callable[[], None] = lambda: None,
        timeout: float = 0.0,
        can_wait: bool = True,
    ) -> None:
        self._simulation = simulation
        self._service = service
        self._on_poll = on_poll
        self.timeout = timeout
        self._can_wait = can_wait
        self._polled = self._served = 0.0
        self._serve_after = _SERVE_AFTER
        self.is_serving = False
        """True while requests of clients are carried out, such as a reset."""
        self.stop = stop or StopCondition()
        """Stop condition of the run."""
        self.rate = rate if isinstance(rate, RateControl) else RateControl(rate)
        """Rate control of the run."""
        self.pacer = RealTimePacer(simulation, self.rate, sleep=self._serve)

    @property
    def pace(self) -> PaceFigures | None:
        """Pace so far; None if time does not follow the wall clock."""
        if self.rate.speed is None or (self._service is not None and self._service.lockstep):
            return None
        return PaceFigures(self.pacer.factor, self.pacer.max_lateness, self.pacer.held)

    def run(self) -> None:
        """Step the simulation until the stop condition holds.

        Raises:
            SimulationError: the state has become unstable.
        """
        if self._service is not None and self._service.lockstep:
            self._run_lockstep(self._service)
            return
        clock, stop = self._simulation.clock, self.stop
        while clock.now < stop.deadline:
            self._simulation.is_paced = self.rate.speed is not None
            self.tick()

    def tick(self) -> bool:
        """Serve clients until the rate control allows the next tick, and step; False if the run must stop instead.

        Raises:
            SimulationError: the state has become unstable.
        """
        rate = self.rate
        if (rate.is_paused or self.stop.is_requested) and not self._wait_for_rate():
            return False
        if rate.speed is not None and not self._wait_for_clients():
            return False
        self.pacer.step()
        self._serve_and_poll()
        return True

    def _wait_for_clients(self) -> bool:
        """Serve clients while time stands for one that is behind; return False if the run must stop."""
        service = self._service
        if service is None or not self._can_wait or not service.hold_time():
            return True
        started = time.perf_counter()
        while not self.stop.is_requested and service.hold_time():
            self._serve(_NAP, until_request=False)
            self._serve_and_poll()
        self.pacer.hold(time.perf_counter() - started)
        return not self.stop.is_requested

    def _wait_for_rate(self) -> bool:
        """Serve clients while time stands; return False if the run must stop."""
        while not (self.stop.is_requested or self.rate.take()):
            # shortly after a request, as for a single step, which begins when the turn of the clients is over
            self._serve(_NAP if self._service is None else self._serve_after, until_request=False)
            self._serve_and_poll()
        return not self.stop.is_requested

    def _run_lockstep(self, service: ClientService) -> None:
        clock, stop, end = self._simulation.clock, self.stop, _FOREVER
        while not stop.is_requested and time.perf_counter() < end:
            is_over = clock.now >= stop.deadline
            if is_over and end == _FOREVER:
                end = time.perf_counter() + self.timeout
                continue
            request = service.advance_request
            if request is None:
                self._serve(_POLL / 2)
            elif is_over and request.until > clock.message_time():
                service.answer(request, RunEndedError(stop.reason))
            else:
                self._grant(service, request)
            self._serve_and_poll()

    def _grant(self, service: ClientService, request: Any) -> None:
        """Advance time as a client requested; stop early if the client is gone."""
        clock, stop = self._simulation.clock, self.stop
        while clock.message_time() < request.until and clock.now < stop.deadline:
            while service.is_client_behind and not stop.is_requested:
                # lockstep loses no message: a client that is behind has to read first
                self._serve(_POLL / 2)
            if request.client.is_gone or not self._wait_for_rate() or request.client.is_gone:
                return
            self.pacer.step()
            if request.each_tick or request.client.has_news:
                break
            self._serve_and_poll()
        service.answer(request)

    def _serve_and_poll(self) -> None:
        """Serve and poll if their last turn is long enough ago."""
        now = time.perf_counter()
        if now - self._served > self._serve_after:
            self._serve(0.0)
        if now - self._polled > _POLL:
            self._polled = now
            self._on_poll()

    def _serve(self, seconds: float, *, until_request: bool = True) -> None:
        if self._service is not None:
            self.is_serving = True
            try:
                is_busy = self._service.wait(seconds, until_request=until_request)
            finally:
                self.is_serving = False
            self._serve_after = _SERVE_AFTER if is_busy else min(2.0 * self._serve_after, _SERVE_IDLE_AFTER)
        elif seconds > 0.0:
            time.sleep(seconds)
        self._served = time.perf_counter()
