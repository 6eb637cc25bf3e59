"""The node's status: told when it has changed, and no more than ten times a second."""

from __future__ import annotations

from fractions import Fraction

from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.sampling import advertise
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages.cellwright_msgs import TeleopStatus
from cellwright.robot.commander import Commander

PERIOD = Fraction(1, 10)
"""Least time between two messages [s]."""


class StatusTopic(Device):
    """Publishes the status; a late listener gets the newest one.

    It counts what has come in since the process began, so it is no state: after a restore it is published anew.

    Args:
        row: the topic in the contract's table.
        rank: of topics that are due together, lower ones come first.
    """

    def __init__(self, bus: Bus, simulation: Simulation, row: Row, commander: Commander, *, rank: int) -> None:
        super().__init__(row.name)
        self._bus, self._commander = bus, commander
        self._publisher = advertise(bus, row)
        simulation.watch(row.name, PERIOD, self._publish, rank)

    def reset(self) -> None:
        """Begin a run: no message of the last one is left."""
        self._bus.forget_latched()

    def set_state(self, state: State) -> None:
        """Go on from a saved moment, as at the beginning of a run."""
        super().set_state(state)
        self.reset()

    def _publish(self, _index: int) -> None:
        status = status_of(self._commander, self._bus)
        if status != self._publisher.newest:
            self._publisher.publish(status)


def status_of(commander: Commander, bus: Bus) -> TeleopStatus:
    """The status as it is now."""
    return TeleopStatus(
        enabled=commander.is_enabled,
        emergency_stop=commander.is_stopped,
        resetting=commander.is_homing,
        silent=commander.watchdog.is_all_silent,
        commander=", ".join(commander.gate.commanders),
        taken=commander.counts.taken,
        refused=bus.refusals.total,
        ignored=commander.counts.ignored,
        unknown_names=list(commander.notices.unknown),
        message=_sentence(commander),
    )


def _sentence(commander: Commander) -> str:
    """What there is to say: why commands are not followed, or from whom they come."""
    if commander.is_stopped:
        return f"{commander.why_held}; /io_teleop/clear_emergency_stop ends it"
    if not commander.is_enabled:
        return "takes no commands: /io_teleop/set_enabled switches them on"
    if commander.is_homing:
        return "on its way home; commands are ignored meanwhile"
    if commander.watchdog.topics:
        return f"joints are held: nothing has come on {', '.join(commander.watchdog.topics)}"
    if commander.why_held:
        return commander.why_held
    commanders = commander.gate.commanders
    return f"follows {', '.join(commanders)}" if commanders else "waits for commands"
