"""What every sensor has in common: a period, a latency, noise, a switch, and listeners."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, Generic, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import Cadence, Watch, nanoseconds
from cellwright.engine.random_streams import SampleNoise
from cellwright.engine.simulation import Device, Simulation, State
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What a sensor found in one sample.

    Attributes:
        time_ns: simulation time of the tick in which it was measured [ns].
        sample: number of the sample; sample n is due at n times the period.
    """

    time_ns: int
    sample: int


R = TypeVar("R", bound=Reading)


class SensorOptions(TypedDict, total=False):
    """What every sensor takes by keyword; see `Sensor`."""

    period: Fraction | None
    latency: Fraction
    noise: float
    enabled: bool


_FIRST_RANK = 10_000  # after the topics that need no sensor


@dataclass(slots=True, eq=False)
class _Listener(Generic[R]):
    """Somebody who gets readings measured after `since` [ns]."""

    callback: Callable[[R], None]
    since: int
    active: bool = True


class Sensor(Device, ABC, Generic[R]):
    """A device that looks at the cell and leaves it as it is.

    It measures only while somebody listens. A reading depends on the state of the cell and on its sample number, never
    on who asked or since when: watching changes nothing.

    Args:
        name: name of the device; its noise is drawn under this name.
        world_T_sensor: where it is fixed.
        period: time between two samples [s]; None takes the `default_period` of the kind.
        latency: time from measuring a sample to its delivery [s]. It is delivered at the first tick at or after that.
        noise: factor on the standard deviations of the kind of sensor: 1 as they are, 0 none at all.
        enabled: whether it is switched on when a run begins.

    Raises:
        UsageError: a number that means nothing.
    """

    default_period: ClassVar[Fraction]
    needs_positions: ClassVar[bool] = True
    """Whether `measure` reads positions of bodies and geoms, which are brought up to date before."""

    def __init__(
        self,
        name: str,
        world_T_sensor: Pose,
        *,
        period: Fraction | None = None,
        latency: Fraction = Fraction(0),
        noise: float = 1.0,
        enabled: bool = True,
    ) -> None:
        super().__init__(name)
        if latency < 0:
            raise UsageError(f"sensor {name!r}: a latency cannot be below 0 s, as {latency} is")
        if not (noise >= 0 and math.isfinite(noise)):
            raise UsageError(f"sensor {name!r}: a noise factor must be finite and not below 0, as {noise} is")
        if not world_T_sensor.is_finite():
            raise UsageError(f"sensor {name!r}: its pose is not finite: {world_T_sensor}")
        self.world_T_sensor = world_T_sensor
        self.frame = f"{name}_frame"
        """Name of the frame that the readings are given in."""
        self.noise = noise
        self._cadence = Cadence(self.default_period if period is None else period)
        self._latency = latency
        self._latency_ns = nanoseconds(latency)
        self._enabled_at_start = enabled
        self._enabled = enabled
        self._chance: SampleNoise | None = None
        self._rank = _FIRST_RANK
        self._listeners: list[_Listener[R]] = []
        self._under_way: deque[R] = deque()
        self._watches: list[Watch] = []

    @property
    def period(self) -> Fraction:
        """Time between two samples [s]."""
        return self._cadence.period

    @property
    def latency(self) -> Fraction:
        """Time from measuring a sample to its delivery [s]."""
        return self._latency

    @property
    def enabled(self) -> bool:
        """Whether it is switched on. Switched off it gives no readings, and those under way are lost."""
        return self._enabled

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self._enabled = enabled
        if not enabled:
            self._lose_under_way()

    @abstractmethod
    def measure(self, index: int) -> R:
        """Sample number `index`, measured now. Positions in the engine's data are up to date."""

    def read(self) -> R:
        """The reading that a listener without latency would have last got, were this tick its time.

        Raises:
            UsageError: the sensor is switched off.
        """
        if not self._enabled:
            raise UsageError(f"sensor {self.name!r} is switched off")
        simulation = self.simulation
        simulation.refresh()
        return self.measure(self._cadence.first_at(simulation.now + 1) - 1)

    def normal(self, index: int, size: int) -> NDArray[np.float64]:
        """Noise of sample `index` in units of standard deviations, shape (size,); zeros without noise."""
        if self._chance is None or self.noise == 0.0:
            return np.zeros(size)
        return self.noise * self._chance.normal(index, size)

    def describe(self) -> dict[str, Any]:
        """What viewers draw of it, as JSON values: `name`, `position`, `quaternion`, `form`, and its figures."""
        pose = self.world_T_sensor
        return {"name": self.name, "position": pose.position, "quaternion": pose.quaternion, "form": "other"}

    def overlay(self) -> dict[str, Any] | None:
        """What viewers draw of a reading now, as JSON values; None for a kind of sensor that must not be read for that.

        It has `sees`, whether there is something, and `ranges` [m] along its rays, null for one that meets nothing.
        The sensor has to be switched on.
        """
        return None

    def listen(self, callback: Callable[[R], None]) -> Callable[[], None]:
        """Have every reading measured from now on given to `callback`, in the thread that steps the simulation.

        What is returned ends it; calling it again does nothing.
        """
        listener = _Listener(callback, self.simulation.now)
        self._listeners.append(listener)
        self._arm()

        def leave() -> None:
            if listener.active:
                listener.active = False
                self._listeners.remove(listener)
                if not self._listeners:
                    self._disarm()

        return leave

    def _arm(self) -> None:
        if not self._watches:
            self._watches.append(self.simulation.watch(self.name, self.period, self._sample, self._rank))
            if self._latency_ns:
                self._watches.append(self.simulation.watch(self.name, None, self._deliver_due, self._rank))

    def _disarm(self) -> None:
        for watch in self._watches:
            watch.cancel()
        self._watches.clear()
        self._lose_under_way()

    def _sample(self, index: int) -> None:
        if not self._enabled:
            return
        if self.needs_positions:
            self.simulation.refresh()
        reading = self.measure(index)
        if self._latency_ns:
            self._under_way.append(reading)
        else:
            self._deliver(reading)

    def _deliver_due(self, _tick: int) -> None:
        latest = self.simulation.now - self._latency_ns
        while self._under_way and self._under_way[0].time_ns <= latest:
            self._deliver(self._under_way.popleft())

    def _lose_under_way(self) -> None:
        """Forget what was measured and not delivered yet."""
        self._under_way.clear()

    def _deliver(self, reading: R) -> None:
        for listener in tuple(self._listeners):
            # who came after a reading was measured does not get it, whoever else was listening then
            if listener.active and reading.time_ns > listener.since:
                listener.callback(reading)

    def attach(self, simulation: Simulation) -> None:
        """Take a place in a simulation; its seed is the root of the noise."""
        super().attach(simulation)
        self._chance = SampleNoise(simulation.seed, self.name)
        # those that are due together have their turn in the order of the devices, whoever began to listen first
        self._rank = _FIRST_RANK + len(simulation.devices)

    def reset(self) -> None:
        """Begin a run, switched on or off as it was made; who listens goes on listening."""
        self.enabled = self._enabled_at_start
        self._forget_time()

    def get_state(self) -> State:
        """The switch."""
        return {"enabled": self._enabled}

    def set_state(self, state: State) -> None:
        """Set the switch as it was; readings under way are lost, who listens goes on listening."""
        self.enabled = state["enabled"]
        self._forget_time()

    def close(self) -> None:
        """Send all listeners away."""
        for listener in self._listeners:
            listener.active = False
        self._listeners.clear()
        self._disarm()

    def _forget_time(self) -> None:
        """Time has jumped: drop what was measured in the other time, and give all that follows to all."""
        self._lose_under_way()
        for listener in self._listeners:
            listener.since = -1
