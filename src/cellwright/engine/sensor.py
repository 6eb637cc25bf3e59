"""Base class of all sensors: period, latency, noise, a switch, and listeners."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar, Generic, Self, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import Cadence, PeriodicCallback, nanoseconds
from cellwright.engine.device import Device, State
from cellwright.engine.random_streams import SampleNoise
from cellwright.engine.simulation import Simulation
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

_FIRST_RANK = 10_000  # after the topics that need no sensor
R = TypeVar("R", bound="Reading")


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Reading of a sensor in one sample. A kind of sensor adds its own fields.

    Example:
        >>> @dataclass(frozen=True, slots=True, kw_only=True)
        ... class Height(Reading):
        ...     height: float
        >>> Height(time_ns=100_000_000, sample=1, height=0.75)
        Height(time_ns=100000000, sample=1, height=0.75)

    Attributes:
        time_ns: simulation time of the tick of the measurement [ns].
        sample: number of the sample; sample n is due at n times the period.
    """

    time_ns: int
    sample: int

    def restamped(self, time_ns: int) -> Self:
        """Return the reading with another time, for a message."""
        return replace(self, time_ns=time_ns)


class SensorOptions(TypedDict, total=False):
    """Keyword arguments of every sensor; see `Sensor`."""

    period: Fraction | None
    latency: Fraction
    noise: float
    enabled: bool


@dataclass(slots=True, eq=False)
class _ReadingListener(Generic[R]):
    """Listener that gets readings measured after `since` [ns]."""

    callback: Callable[[R], None]
    since: int
    active: bool = True


class Sensor(Device, ABC, Generic[R]):
    """A device that observes the cell without changing it.

    It measures only while it has a listener. A reading depends on the state of the cell and on its sample number only,
    not on the listeners: watching changes nothing.

    Example:
        >>> from mujoco import MjModel
        >>> class SampleCounter(Sensor[Reading]):
        ...     default_period = Fraction(1, 10)
        ...     def measure(self, index):
        ...         return Reading(time_ns=self.simulation.now, sample=index)
        >>> simulation, sensor = Simulation(MjModel.from_xml_string("<mujoco/>")), SampleCounter("counter", Pose())
        >>> simulation.add(sensor)
        >>> simulation.reset()
        >>> leave = sensor.listen(print)
        >>> simulation.step_until(100_000_000)
        Reading(time_ns=100000000, sample=1)

    Args:
        name: name of the device, and of its noise's random stream.
        world_T_sensor: pose of the sensor, which is fixed.
        period: time between two samples [s]; None: the `default_period` of the class.
        latency: time from measuring a sample to its delivery [s]. It is delivered at the first tick at or after that.
        noise: factor on the standard deviations of the kind of sensor: 1 as they are, 0 no noise.
        enabled: True if it is switched on at the start of a run.

    Raises:
        UsageError: a number out of range.
    """

    default_period: ClassVar[Fraction]
    needs_positions: ClassVar[bool] = True
    """True if `measure` reads positions of bodies and geoms, which are refreshed before."""

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
            raise UsageError(f"sensor {name!r}: latency must not be below 0 s (got {latency})")
        if not (noise >= 0 and math.isfinite(noise)):
            raise UsageError(f"sensor {name!r}: noise must be finite and not below 0 (got {noise})")
        if not world_T_sensor.is_finite():
            raise UsageError(f"sensor {name!r}: its pose must be finite (got {world_T_sensor})")
        self.world_T_sensor = world_T_sensor
        self.frame = f"{name}_frame"
        """Name of the frame of the readings."""
        self.noise = noise
        self._cadence = Cadence(self.default_period if period is None else period)
        self._latency = latency
        self._latency_ns = nanoseconds(latency)
        self._enabled_at_start = enabled
        self._enabled = enabled
        self._noise_stream: SampleNoise | None = None
        self._rank = _FIRST_RANK
        self._listeners: list[_ReadingListener[R]] = []
        self._pending_readings: deque[R] = deque()
        self._watches: list[PeriodicCallback] = []

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
        """True if it is switched on. While it is off there are no readings, and pending ones are lost."""
        return self._enabled

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self._enabled = enabled
        if not enabled:
            self._drop_pending()

    @abstractmethod
    def measure(self, index: int) -> R:
        """Measure sample number `index` now. Positions in the engine's data are up to date."""

    def read(self) -> R:
        """Return the latest reading of a listener without latency, as if measured in this tick.

        Raises:
            UsageError: the sensor is switched off.
        """
        return self.measure(self._latest_index())

    def _latest_index(self) -> int:
        """Return the number of the sample of now, and bring positions in the engine's data up to date."""
        if not self._enabled:
            raise UsageError(f"sensor {self.name!r} is switched off")
        simulation = self.simulation
        simulation.refresh()
        return self._cadence.first_at(simulation.now + 1) - 1

    def normal(self, index: int, size: int) -> NDArray[np.float64]:
        """Return the noise of sample `index` in units of standard deviations, shape (size,); zeros without noise."""
        if self._noise_stream is None or self.noise == 0.0:
            return np.zeros(size)
        normal = self._noise_stream.normal(index, size)
        return normal if self.noise == 1.0 else self.noise * normal

    def describe(self) -> dict[str, Any]:
        """Return the data that viewers draw, as JSON values.

        Returns:
            `name`, `position` [m], `quaternion` (w, x, y, z), `form`, and figures of the kind of sensor.
        """
        pose = self.world_T_sensor
        return {"name": self.name, "position": pose.position, "quaternion": pose.quaternion, "form": "other"}

    def overlay(self) -> dict[str, Any] | None:
        """Return a present reading for viewers as JSON values; None for a kind of sensor that they must not read.

        It has `sees`, true if something is detected, and `ranges` [m] along its rays, null for a ray without a hit. The
        sensor must be switched on.
        """
        return None

    def listen(self, callback: Callable[[R], None]) -> Callable[[], None]:
        """Call `callback` with every reading measured from now on, in the thread that steps the simulation.

        Returns:
            A function that ends it; further calls do nothing.
        """
        listener = _ReadingListener(callback, self.simulation.now)
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
        self._drop_pending()

    def _sample(self, index: int) -> None:
        if not self._enabled:
            return
        if self.needs_positions:
            self.simulation.refresh()
        reading = self.measure(index)
        if self._latency_ns:
            self._pending_readings.append(reading)
        else:
            self._deliver(reading)

    def _deliver_due(self, _tick: int) -> None:
        latest = self.simulation.now - self._latency_ns
        while self._pending_readings and self._pending_readings[0].time_ns <= latest:
            self._deliver(self._pending_readings.popleft())

    @property
    def pending(self) -> Iterable[Any]:
        """Readings that were measured and not delivered yet, for a snapshot of the same process."""
        return self._pending_readings

    @pending.setter
    def pending(self, readings: Iterable[Any]) -> None:
        self._pending_readings = deque(readings)

    def _drop_pending(self) -> None:
        """Drop readings that were measured and not delivered yet."""
        self._pending_readings.clear()

    def _deliver(self, reading: R) -> None:
        for listener in tuple(self._listeners):
            # a listener added after the measurement does not get the reading, even if others listened then
            if listener.active and reading.time_ns > listener.since:
                listener.callback(reading)

    def attach(self, simulation: Simulation) -> None:
        """Join a simulation; its seed is the root of the noise."""
        super().attach(simulation)
        self._seed_noise()
        # sensors due at the same time act in the order of the devices, not of their first listeners
        self._rank = _FIRST_RANK + len(simulation.devices)

    def reset(self) -> None:
        """Start a run with the initial switch, and the noise of the simulation's seed; listeners stay."""
        self.enabled = self._enabled_at_start
        if self._seed != self.simulation.seed:
            self._seed_noise()
        self._after_time_jump()

    def _seed_noise(self) -> None:
        self._seed = self.simulation.seed
        self._noise_stream = SampleNoise(self._seed, self.name)

    def get_state(self) -> State:
        """Return the state of the switch."""
        return {"enabled": self._enabled}

    def set_state(self, state: State) -> None:
        """Restore the switch; pending readings are lost, listeners stay."""
        self.enabled = state["enabled"]
        self._after_time_jump()

    def close(self) -> None:
        """Remove all listeners."""
        for listener in self._listeners:
            listener.active = False
        self._listeners.clear()
        self._disarm()

    def _after_time_jump(self) -> None:
        """Drop pending readings after a jump of time, and deliver all later readings to all listeners."""
        self._drop_pending()
        for listener in self._listeners:
            listener.since = -1
