"""Devices: what acts in a simulation, and followers, which only know of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeAlias

import mujoco

from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from cellwright.engine.simulation import Simulation

State: TypeAlias = Mapping[str, Any]
"""JSON values: numbers, strings, booleans, None, and lists and dicts of them."""


class PlainState:
    """State that consists of attributes, each a JSON value that is replaced and never modified in place."""

    STATE: ClassVar[tuple[str, ...]] = ()
    """Names of the attributes. The key has no leading underscore."""

    def get_state(self) -> State:
        """Return the whole state as JSON values."""
        return {name.lstrip("_"): getattr(self, name) for name in self.STATE}

    def set_state(self, state: State) -> None:
        """Restore the state that `get_state` returned."""
        for name in self.STATE:
            setattr(self, name, state[name.lstrip("_")])


class Device(PlainState):
    """Base class of everything that acts in the simulation.

    Lifecycle: `attach` (once, by `Simulation.add`), then `reset` at the start of every run. In each tick come
    `before_step`, `integrate`, `drive` and `after_step`, and `handle` for the events that it scheduled; `close` at the
    end. Only hooks that a subclass overrides are called, and only while the device is `stepping`. A device with nothing
    to do for a while calls `set_stepping(False)`.

    `get_state` returns the state as plain JSON values, which are part of the state hash and of snapshots. `STATE` names
    the plain attributes. For anything else a subclass overrides `get_state` and `set_state`. Listeners, caches and
    counters of sent messages are not state: watching changes nothing.

    Example:
        >>> class StepCounter(Device):
        ...     STATE = ("steps",)
        ...     steps = 0
        ...     def after_step(self):
        ...         self.steps += 1
        >>> import mujoco
        >>> from cellwright.engine.simulation import Simulation
        >>> simulation = Simulation(mujoco.MjModel.from_xml_string("<mujoco/>"))
        >>> simulation.add(StepCounter("counter"))
        >>> simulation.reset()
        >>> simulation.step()
        >>> simulation.device("counter").get_state()
        {'steps': 1}

    Args:
        name: name of the device, unique in its simulation.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.stepping = True
        self._simulation: Simulation | None = None

    @property
    def simulation(self) -> Simulation:
        """The simulation of this device.

        Raises:
            UsageError: it has none yet.
        """
        if self._simulation is None:
            raise UsageError(f"device {self.name!r} has not been added to a simulation")
        return self._simulation

    def attach(self, simulation: Simulation) -> None:
        """Join a simulation. A subclass looks up its model addresses here."""
        self._simulation = simulation

    def reset(self) -> None:
        """Start a run: the simulation is at time 0 and its model in its first pose."""

    def before_step(self) -> None:
        """Write the inputs of the step from now to now + timestep."""

    def integrate(self) -> bool:
        """Make this step in place of the engine and return True, or return False for a step of the engine.

        It is not called while another device overrides `drive`, which the engine's step calls.
        """
        return False

    def drive(self) -> None:
        """Change the constraints of the current step: the engine has set them up and not solved them yet.

        This makes a step slightly slower; nearly every device can use `before_step`.
        """

    def after_step(self) -> None:
        """Evaluate the step. Positions of bodies are up to date only after `simulation.refresh()`."""

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Handle an event that this device scheduled with `simulation.schedule`, by its method `handle_<kind>`.

        Raises:
            UsageError: it has no such method.
        """
        method = getattr(self, f"handle_{kind}", None)
        if method is None:
            raise UsageError(f"device {self.name!r} does not know the event {kind!r}{arguments!r}")
        method(*arguments)

    def get_record(self) -> State:
        """Return this device's observations outside of its state, as JSON values; empty if there are none.

        Snapshots and checkpoints carry them, and the state hash leaves them out: the run never depends on them.
        """
        return {}

    def set_record(self, record: State) -> None:
        """Restore the observations that `get_record` returned; empty for none."""

    def close(self) -> None:
        """Close files, threads and the like at the end of the device's life."""

    def set_stepping(self, stepping: bool) -> None:  # noqa: FBT001
        """Switch the calls of the step hooks on or off, from the next tick on."""
        if stepping != self.stepping:
            self.stepping = stepping
            self.simulation.collect_hooks()


class StepHooks:
    """Step hooks that devices override, in the order of the devices; the base class's do nothing and cost a call."""

    def __init__(self, stepping: Iterable[Device]) -> None:
        base, stepping = Device, list(stepping)
        self.before = [d.before_step for d in stepping if type(d).before_step is not base.before_step]
        driving = [d for d in stepping if type(d).drive is not base.drive]
        self.drive = [d.drive for d in driving]
        integrating = [d for d in stepping if type(d).integrate is not base.integrate]
        self.integrate = integrating[0].integrate if integrating and driving == integrating else None
        self.is_plain = not driving and self.integrate is None
        """True if the engine makes the whole step."""
        self.after = [d.after_step for d in stepping if type(d).after_step is not base.after_step]

    def step(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Make a step of the engine in which devices take part."""
        if self.integrate is not None and self.integrate():
            return
        if not self.drive:
            mujoco.mj_step(model, data)
            return
        mujoco.mj_step1(model, data)
        for hook in self.drive:
            hook()
        mujoco.mj_step2(model, data)


class Follower(Protocol):
    """Follower of a run in this process, such as a client: what it knows of the run is no part of the state."""

    def remember(self) -> object:
        """Return what it knows now, for a snapshot."""

    def forget(self) -> None:
        """Forget what it knows: time jumps, to the begin of a run or to a snapshot."""

    def recall(self, memory: Any) -> None:
        """Know again what `remember` returned: the snapshot that contains it has been restored."""
