"""What every thing on the floor has in common: one life, and a state that is plain data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from cellwright.engine.simulation import Simulation

State: TypeAlias = Mapping[str, Any]
"""JSON values: numbers, strings, booleans, None, and lists and dicts of them."""


class PlainState:
    """State that is a number of attributes, each of which is a JSON value that is replaced and never changed."""

    STATE: ClassVar[tuple[str, ...]] = ()
    """Names of the attributes. A leading underscore is no part of the key."""

    def get_state(self) -> State:
        """All that is remembered, as JSON values."""
        return {name.lstrip("_"): getattr(self, name) for name in self.STATE}

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned before."""
        for name in self.STATE:
            setattr(self, name, state[name.lstrip("_")])


class Device(PlainState):
    """A thing on the floor.

    Its life: `attach` (once, by `Simulation.add`), `reset` (at the start of every run), then in each tick
    `before_step`, `drive` and `after_step`, and `handle` for the events that it scheduled; `close` at the end. Only
    hooks that a subclass overrides are called, and only while the device is `stepping`; a device that has nothing to do
    for a while calls `set_stepping(False)`.

    What a device remembers is returned by `get_state` as plain JSON values: it is part of the state hash and of
    snapshots. `STATE` names what is a plain attribute; for anything else a subclass overrides `get_state` and
    `set_state`. Listeners, caches and counters of messages do not belong there: watching changes nothing.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.stepping = True
        self._simulation: Simulation | None = None

    @property
    def simulation(self) -> Simulation:
        """The simulation that this device lives in.

        Raises:
            UsageError: it lives in none yet.
        """
        if self._simulation is None:
            raise UsageError(f"device {self.name!r} has not been added to a simulation")
        return self._simulation

    def attach(self, simulation: Simulation) -> None:
        """Take a place in a simulation. A subclass looks up its model addresses here."""
        self._simulation = simulation

    def reset(self) -> None:
        """Begin a run: the simulation stands at time 0 and its model in its first pose."""

    def before_step(self) -> None:
        """Write what the step from now to now + timestep is to be driven with."""

    def drive(self) -> None:
        """Change the constraints of the step that is under way: the engine has set them up and not solved them yet.

        With it a step costs a little more; nearly every device can do with `before_step`.
        """

    def after_step(self) -> None:
        """Look at what the step did. Positions of bodies are up to date only after `simulation.refresh()`."""

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Carry out an event that this device scheduled with `simulation.schedule`, by its method `handle_<kind>`.

        Raises:
            UsageError: it has no such method.
        """
        method = getattr(self, f"handle_{kind}", None)
        if method is None:
            raise UsageError(f"device {self.name!r} does not know the event {kind!r}{arguments!r}")
        method(*arguments)

    def get_record(self) -> State:
        """What this device has observed besides its state, as JSON values; empty for nothing.

        Snapshots and checkpoints carry it, and the state hash leaves it out: nothing that happens depends on it.
        """
        return {}

    def set_record(self, record: State) -> None:
        """Take over what `get_record` returned before; empty for nothing."""

    def close(self) -> None:
        """End of life: let go of files, threads and the like."""

    def set_stepping(self, stepping: bool) -> None:  # noqa: FBT001
        """Have the step hooks called, or not, from the next tick on."""
        if stepping != self.stepping:
            self.stepping = stepping
            self.simulation.rehook()
