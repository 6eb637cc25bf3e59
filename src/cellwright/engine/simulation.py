"""Simulation of devices on one clock: stepping, events and watches."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import mujoco
import numpy as np

from cellwright.engine import engine_state, random_streams
from cellwright.engine.clock import Clock, EventQueue, Inbox, PeriodicCallback, PeriodicCallbacks, nanoseconds
from cellwright.engine.device import Device, Follower, StepHooks
from cellwright.engine.engine_state import unstable
from cellwright.util.errors import SimulationError, UnknownNameError, UsageError


class Simulation:
    """Simulation: time, the engine's model and data, and the devices.

    The order of a tick is fixed: inbox, `before_step` of the devices, the engine's step, `after_step` of the devices,
    due events, watches. The events include the referee's. `drive` runs in the middle of the engine's step.

    Args:
        model: a compiled model. `opt.timestep` is set from `timestep`.
        timestep: length of a tick [s], rational.
        seed: the root seed of all random streams.
        first_pose: writes the initial positions and setpoints that differ from the model's own.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        timestep: Fraction = Fraction(1, 500),
        seed: int = 0,
        first_pose: Callable[[mujoco.MjData], None] = lambda _data: None,
    ) -> None:
        model.opt.timestep = float(timestep)
        # without this the engine would silently restart a run that has become unstable
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self.model = model
        self.first_model = model
        """The model of a run's beginning."""
        self.data = mujoco.MjData(model)
        self.seed = seed
        self.clock = Clock(timestep)
        self.events = EventQueue()
        self.watches = PeriodicCallbacks()
        self.inbox = Inbox()
        self.devices: dict[str, Device] = {}
        self.is_paced = False
        """True if time follows the wall clock and waits for no client; the loop sets it."""
        self.on_reset: list[Callable[[], None]] = []
        """Callbacks before a reset, while the old state is still there."""
        self.on_restart: list[Callable[[], None]] = []
        """Callbacks in a reset, when the clock stands at the begin of the run and no device has been reset yet."""
        self.rewind_refusals: list[Callable[[], str]] = []
        """Callbacks that return why no snapshot may be restored now, empty if one may."""
        self.on_rewind: list[Callable[[int], None]] = []
        """Callbacks before a snapshot is restored, with its time [ns]."""
        self.followers: list[Follower] = []
        """Clients in this process: they forget an earlier run, and a snapshot contains what they know."""
        self.on_model: list[Callable[[], None]] = []
        """Callbacks after `model` and `data` were replaced, before their state is set."""
        self.on_wake: list[Callable[[int], None]] = []
        """Callbacks for the tree that a call of `wake` or `keep_awake` wakes; the engine does so in the next step."""
        self.on_touch: list[Callable[[], None]] = []
        """Callbacks for positions that were written directly."""
        self.on_renewal: list[Callable[[], None]] = []
        """Callbacks before a checkpoint is taken and the engine's data are built again from it, all bodies awake."""
        self.runs = 0
        """Number of runs so far. A change tells viewers that time starts again; it is not part of the state."""
        self._first_pose = first_pose
        self._hooks = StepHooks(())
        self._refreshed_at = -1
        self._is_in_tick = False
        self._pristine = {
            name: getattr(model, name).copy() for name in (*engine_state.CHANGING_FIELDS, *engine_state.CULLING_FIELDS)
        }

    def add(self, device: Device) -> None:
        """Add a device. Devices act in the order in which they were added.

        Raises:
            UsageError: a device of this name exists.
        """
        if device.name in self.devices:
            raise UsageError(f"two devices have the name {device.name!r}")
        self.devices[device.name] = device
        device.attach(self)
        self.collect_hooks()

    def device(self, name: str) -> Device:
        """Return a device by name.

        Raises:
            UnknownNameError: there is no device of this name.
        """
        if name not in self.devices:
            raise UnknownNameError("device", name, self.devices)
        return self.devices[name]

    def generator(self, name: str) -> np.random.Generator:
        """Return a new generator from the child of the root seed with this name."""
        return random_streams.generator(self.seed, name)

    def collect_hooks(self) -> None:
        """Collect the step hooks of the stepping devices."""
        self._hooks = StepHooks(device for device in self.devices.values() if device.stepping)

    @property
    def now(self) -> int:
        """Simulation time [ns]."""
        return self.clock.now

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self.clock.now / 1e9

    def reset(self, *, keeps_clock: bool = False, prepare: Callable[[], None] = lambda: None) -> None:
        """Start a run: time 0, the model's first pose, every device reset in order.

        Args:
            keeps_clock: message time goes on from its present value; otherwise it restarts at 0. The run is the same.
            prepare: changes the seed or the first model's first pose, once the old state is of no more use.

        Raises:
            SimulationError: the engine cannot compute with the model.
            UsageError: called within a tick.
        """
        self.refuse_within_tick()
        for callback in self.on_reset:
            callback()
        prepare()
        self.runs += 1
        offset = self.clock.message_time() if keeps_clock else 0
        if self.model is not self.first_model:
            self.use_model(self.first_model)
        mujoco.mj_resetData(self.model, self.data)
        self._restore_fields()
        self._first_pose(self.data)
        self.clock.set_tick(0)
        self.clock.offset = offset
        self.events.clear()
        self._refreshed_at = -1
        for callback in self.on_restart:
            callback()
        for follower in self.followers:
            follower.forget()
        for device in self.devices.values():
            device.reset()
        try:
            mujoco.mj_forward(self.model, self.data)
        except mujoco.FatalError as error:
            raise self._engine_error(error) from None
        self.collect_hooks()
        self.watches.reschedule(0)

    def use_model(self, model: mujoco.MjModel) -> None:
        """Replace the model by one with more bodies behind those of the first one, or by the first one itself.

        Ids and addresses of the first one are valid in all. `data` is new, and the caller sets the state. What keeps
        arrays of the engine, or arrays with a row for each body, listens to `on_model` or compares `model`.
        """
        if model is self.first_model:
            self._restore_fields()
        model.opt = self.model.opt
        # the solver's tolerance is relative to it
        model.stat.meaninertia = self.model.stat.meaninertia
        self.model, self.data = model, mujoco.MjData(model)
        self._refreshed_at = -1
        for callback in self.on_model:
            callback()

    def _restore_fields(self) -> None:
        for name, values in self._pristine.items():
            getattr(self.first_model, name)[:] = values

    def grow(self, model: mujoco.MjModel) -> None:
        """Continue with a model that has more bodies behind those of the present one; they are asleep.

        With sparse matrices, all others move as before, bit for bit. There are no contacts until the next step: so grow
        in `before_step`.
        """
        before, old = self.model, self.data
        self.use_model(model)
        engine_state.copy_fields(before, model)
        engine_state.copy_data(old, model, self.data)

    def step(self) -> None:
        """Step one tick.

        Raises:
            SimulationError: the state has become unstable, or the engine has no room for all contacts; the rest of the
                run is worthless.
        """
        if self.inbox.waiting:
            self.inbox.empty()
        self._is_in_tick = True
        try:
            for hook in self._hooks.before:
                hook()
            # the others are those of now: a device may have been switched off by the hooks before
            hooks = self._hooks
            try:
                if hooks.is_plain:
                    mujoco.mj_step(self.model, self.data)
                else:
                    hooks.step(self.model, self.data)
            except mujoco.FatalError as error:
                raise self._engine_error(error) from None
            now = self.clock.advance()
            if unstable:
                reason = unstable[0]
                unstable.clear()
                raise SimulationError(f"at {now / 1e9:.3f} s: {reason}")
            for hook in self._hooks.after:
                hook()
            events = self.events
            while events.next_due <= now:
                event = events.pop_due(now)
                if event is not None:
                    self.devices[event.device].handle(event.kind, event.arguments)
            if self.watches.next_due <= now:
                self.watches.run_due(now, self.clock.tick)
        finally:
            self._is_in_tick = False

    def refuse_within_tick(self) -> None:
        """Refuse to replace the state while a tick is under way, as in a callback of a device or of the bus.

        Raises:
            UsageError: one is under way.
        """
        if self._is_in_tick:
            raise UsageError("reset, snapshot and restore need a whole tick; call them after the step, not within it")

    def refuse_rewind(self) -> None:
        """Refuse to restore a snapshot while something needs time to go on.

        Raises:
            UsageError: a tick is under way, or something follows the run that cannot go back, such as a recording.
        """
        self.refuse_within_tick()
        for refusal in self.rewind_refusals:
            if reason := refusal():
                raise UsageError(f"restore: {reason}")

    def _engine_error(self, error: Exception) -> SimulationError:
        """Return the error for a failure of the engine, usually because it has no room for all contacts."""
        reason = str(error).partition("\n")[0]
        return SimulationError(f"at {self.time:.3f} s: the engine gave up: {reason}")

    def step_until(self, time: int) -> None:
        """Step to the first tick at or after `time` [ns]."""
        clock, step = self.clock, self.step
        while clock.now < time:
            step()

    def settle_inbox(self) -> None:
        """Execute waiting commands now, between two ticks."""
        while self.inbox:
            self.inbox.empty()

    def schedule(
        self,
        device: Device,
        kind: str,
        *arguments: Any,
        delay: float | Fraction = 0.0,
        at: int | None = None,
        priority: int = 0,
    ) -> None:
        """Schedule a call of `device.handle(kind, arguments)`.

        The call happens at the first tick at or after the given time. That is the current tick only if its events are
        still to come.

        Args:
            device: the device to call.
            kind: kind of the event.
            arguments: JSON values.
            delay: time from now [s].
            at: time [ns], in place of `delay`.
            priority: order among events at the same time, the lower first.
        """
        time = self.now + nanoseconds(delay) if at is None else at
        self.events.schedule(time, device.name, kind, arguments, priority)

    def cancel(self, device: Device, kind: str) -> None:
        """Cancel a device's scheduled events of one kind."""
        self.events.cancel(device.name, kind)

    def watch(
        self, name: str, period: Fraction | None, action: Callable[[int], None], rank: int = 0
    ) -> PeriodicCallback:
        """Call `action` periodically; it must not change the simulation.

        Args:
            name: name of the watch.
            period: time between two calls [s]; None: each tick.
            action: called with the sample number.
            rank: order among watches that are due at the same time, the lower first.

        Returns:
            The watch, to cancel it.
        """
        return self.watches.add(name, period, action, self.now, rank)

    def refresh(self) -> None:
        """Update positions of bodies and geoms to this tick; done at most once a tick.

        After a step the engine's `xpos` and `xquat` are one step behind `qpos`. Refreshing does not change the run.
        """
        if self._refreshed_at != self.clock.tick:
            mujoco.mj_kinematics(self.model, self.data)
            self._refreshed_at = self.clock.tick

    def touch(self) -> None:
        """Mark positions as written directly in this tick, so that `refresh` computes them again."""
        self._refreshed_at = -1
        for callback in self.on_touch:
            callback()

    def wake(self, body: int) -> None:
        """Wake the tree of a body, without changing its state, after a change of its support or load.

        A changed surface velocity or a moved support does not wake sleepers. A velocity written as -0.0 does, because
        the engine compares bytes.
        """
        tree = int(self.model.body_treeid[body])
        if tree >= 0:
            for callback in self.on_wake:
                callback(tree)
            first = int(self.model.tree_dofadr[tree])
            dofs = slice(first, first + int(self.model.tree_dofnum[tree]))
            velocity = self.data.qvel[dofs]
            self.data.qvel[dofs] = np.where(velocity == 0.0, -0.0, velocity)

    def keep_awake(self, body: int) -> None:
        """Wake a tree and restart its count to sleep; else a body released in mid-air could freeze there for ever."""
        tree = int(self.model.body_treeid[body])
        if tree >= 0 and self.data.tree_asleep[tree] < 0:
            self.data.tree_asleep[tree] = engine_state.ASLEEP_AFTER
            for callback in self.on_wake:
                callback(tree)
        else:
            self.wake(body)

    def get_state(self) -> dict[str, Any]:
        """Return the state outside of the engine as JSON values: tick, events and the state of each device."""
        return {
            "tick": self.clock.tick,
            "events": self.events.get_state(),
            "devices": {
                name: {"stepping": device.stepping, **device.get_state()} for name, device in self.devices.items()
            },
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore the state that `get_state` returned; the caller sets the engine's part (`snapshot.py`)."""
        self.clock.set_tick(state["tick"])
        self.events.set_state(state["events"])
        for name, remembered in state["devices"].items():
            device = self.device(name)
            device.stepping = remembered["stepping"]
            device.set_state({key: value for key, value in remembered.items() if key != "stepping"})
        self.collect_hooks()
        self._refreshed_at = -1
        self.watches.reschedule(self.now)

    def get_record(self) -> dict[str, Any]:
        """Return the devices' observations outside of their states, as JSON values; not part of the state hash."""
        return {name: dict(record) for name, device in self.devices.items() if (record := device.get_record())}

    def set_record(self, record: Mapping[str, Any]) -> None:
        """Restore the observations that `get_record` returned."""
        for name, device in self.devices.items():
            device.set_record(record.get(name, {}))

    def state_hash(self, *more: Any) -> str:
        """Return the SHA-256 of the engine's state, the events, the devices and `more` (JSON values), as hex digits."""
        digest = engine_state.hash_engine(self.model, self.data)
        digest.update(json.dumps([self.get_state(), *more], sort_keys=True, allow_nan=True).encode())
        return digest.hexdigest()

    def close(self) -> None:
        """Close every device, in reverse order."""
        for device in reversed(self.devices.values()):
            device.close()
