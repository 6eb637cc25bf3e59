"""A recorded trial that is killed, and the loss of its recording."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from cellwright.recording.format.reader import RecordingFile, recorded_frames
from tests.support.waiting import wait_until

PROGRAM = """
import os, struct, sys
from fractions import Fraction
from pathlib import Path
from cellwright.clients.agents.kitter.agent import KitterAgent
from cellwright.cell.cell import Cell
from cellwright.running.run import load_trial
from cellwright.running.run import RunOptions, run_cell

ticks = os.open(sys.argv[2], os.O_WRONLY | os.O_CREAT)

def note(cell):
    simulation = cell.simulation
    keep = lambda _: os.write(ticks, struct.pack("<q", simulation.now))
    simulation.watch("ticks", None, keep, 10_000)
    sys.stdout.write("running\\n")
    sys.stdout.flush()

cell = Cell(load_trial("lesson"))
options = RunOptions(speed=1.0, at=[(Fraction(1, 100), note)])  # it is not over too soon
run_cell(cell, KitterAgent(), options, record=sys.argv[1])
"""
TICK = 2_000_000
"""Duration of a tick [ns]."""

_TICK = struct.Struct("<q")


@dataclass(frozen=True)
class Loss:
    """Simulation time that was reached before a kill, and that the recording has [ns]."""

    reached: int
    kept: int


def kept_so_far(file: Path) -> int:
    """Return the simulation time that a growing recording has [ns]."""
    with RecordingFile(file) as recording:
        return recording.end_time


def loss(folder: Path, after: int) -> Loss:
    """Record a trial, kill it once this many ticks are in the file, and return the loss."""
    file, ticks = folder / "run.mcap", folder / "ticks"
    command = [sys.executable, "-c", PROGRAM, str(file), str(ticks)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"running\n"
        try:
            wait_until(lambda: kept_so_far(file) >= after * TICK, f"{after} ticks in the file")
        finally:
            process.kill()
    data = ticks.read_bytes()
    noted = [now for (now,) in _TICK.iter_unpack(data[: len(data) // _TICK.size * _TICK.size])]
    os.unlink(ticks)
    with RecordingFile(file) as recording:
        assert not recording.is_complete
        messages = list(recording.messages(["/clock"]))
        for message in recording.messages():
            recording.decode(message)
        list(recording.commands())
        assert recording.scene
        assert any(recorded_frames(recording))
        kept = recording.end_time
    assert len(messages) == kept // TICK, "no tick is missing before the end"
    return Loss(noted[-1], kept)
