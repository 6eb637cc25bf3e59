"""Agent that sends the commands of a recording again, each at its time, through an ordinary client."""

from __future__ import annotations

from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

from cellwright.clients.client.client import Client
from cellwright.engine.clock import NANOSECONDS, nanoseconds
from cellwright.middleware.bus import InputKind
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import CellwrightError, RecordingError, RunEndedError


class RecordedAgent:
    """The commands of a recorded run of a cell, as an agent: `--agent replay:run.mcap`.

    In the trial of the recording, with its seed, it reaches the recorded state hash. In any other cell it is a program
    without eyes: it sends the same commands at the same times.

    Args:
        path: the recording.

    Raises:
        RecordingError: it cannot be read, or no client can do all that was done in it.
    """

    def __init__(self, path: Path) -> None:
        with RecordingFile(path) as recording:
            header = recording.header
            if header.kind != "cell":
                raise RecordingError(f"{path}: is of a {header.kind}; give the recording of a cell")
            if recording.start is not None:
                raise RecordingError(f"{path}: begins at a checkpoint; record a run from its start")
            if recording.end is None:
                raise RecordingError(f"{path}: ends before its run did; record the run again")
            period = _period(header.facts.get("timestep"), path)
            self._end = _end(recording.end.get("simulated"), path)
            self._commands = [(round(each.tick * period), each, each.message()) for each in recording.commands()]
        for _, command, _message in self._commands:
            if command.kind is InputKind.EXTRA:
                raise RecordingError(
                    f"{path}: {command.name} at tick {command.tick} came from a page, and no agent can send it; record "
                    "the run without"
                )

    def run(self, client: Client) -> None:
        """Send the commands, and let time pass up to the end of the recorded run.

        A command that was refused is refused again. Simulation time passes as it did, so the run ends in the same tick.

        Raises:
            RunEndedError: the recorded run is over, or this one is.
        """
        begin = client.transport.now()
        for time, command, message in self._commands:
            _sleep_until(client, begin + time)
            _send(client, command, message)
        _sleep_until(client, begin + self._end)
        # An agent that returned would have its last kits waited for, and the run would be longer.
        raise RunEndedError("the recorded run is over")


def _send(client: Client, command: Command, message: Any) -> None:
    with suppress(CellwrightError):
        (client.call if command.kind is InputKind.CALL else client.publish)(command.name, message)


def _sleep_until(client: Client, time: int) -> None:
    """Let time pass up to a time [ns]; nothing if it has passed."""
    if (left := time - client.transport.now()) > 0:
        client.sleep(left / NANOSECONDS)


def _period(value: object, path: Path) -> Fraction:
    """Return the time of a tick [ns]."""
    match value:
        case [int(numerator), int(denominator)] if numerator > 0 and denominator > 0:
            return Fraction(numerator, denominator) * NANOSECONDS
    raise RecordingError(f"{path}: has no valid time step (got {value!r:.40}); record the run again")


def _end(value: object, path: Path) -> int:
    """Return the time of the end [ns]."""
    if isinstance(value, int | float) and not isinstance(value, bool) and 0.0 <= value < 1e9:
        return nanoseconds(value)
    raise RecordingError(f"{path}: has no valid end of its run (got {value!r:.40}); record the run again")
