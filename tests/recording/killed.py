"""A trial that is recorded and killed at some moment, and what is lost of it."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from cellwright.recording.frames import frames
from cellwright.recording.reader import Recording

PROGRAM = """
import os, struct, sys, time
from fractions import Fraction
from pathlib import Path
from cellwright.agents.kitter.agent import KitterAgent
from cellwright.cell import Cell
from cellwright.face import load_trial
from cellwright.run import RecordOptions, RunOptions, run_cell

ticks = os.open(sys.argv[2], os.O_WRONLY | os.O_CREAT)

def note(cell):
    simulation = cell.simulation
    keep = lambda _: os.write(ticks, struct.pack("<qd", simulation.now, time.monotonic()))
    simulation.watch("ticks", None, keep, 10_000)
    sys.stdout.write("running\\n")
    sys.stdout.flush()

cell = Cell(load_trial("lesson"))
run_cell(cell, KitterAgent(), RunOptions(record=RecordOptions([Path(sys.argv[1])]), at=[(Fraction(1, 100), note)]))
"""
_TICK = struct.Struct("<qd")


@dataclass(frozen=True)
class Loss:
    """What a kill cost: simulated time reached and kept [ns], and the wall time of what is missing [s]."""

    reached: int
    kept: int
    wall: float


def loss(folder: Path, after: float) -> Loss:
    """Record a trial, kill it so many seconds after it began, and see what is left of it."""
    file, ticks = folder / "run.mcap", folder / "ticks"
    command = [sys.executable, "-c", PROGRAM, str(file), str(ticks)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"running\n"
        time.sleep(after)
        process.kill()
        killed = time.monotonic()
    data = ticks.read_bytes()
    noted = list(_TICK.iter_unpack(data[: len(data) // _TICK.size * _TICK.size]))
    os.unlink(ticks)
    with Recording(file) as recording:
        assert not recording.is_complete
        messages = list(recording.messages(["/clock"]))
        for message in recording.messages():
            recording.decode(message)
        list(recording.commands())
        assert recording.scene
        assert any(frames(recording))
        kept = recording.end_time
    assert len(messages) == kept // 2_000_000, "no tick is missing before the end"
    first_lost = next((wall for now, wall in noted if now > kept), killed)
    return Loss(noted[-1][0], kept, killed - first_lost)
