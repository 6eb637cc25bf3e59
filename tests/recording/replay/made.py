"""Recordings of real runs, for tests of their use."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cellwright
from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.recorder import Recorder
from cellwright.running.run import versions


def record(path: Path, work: Callable[[Client], None], *, trial: str = "lesson") -> Path:
    """Record an agent at work in a cell."""
    cell = Cell(cellwright.load_trial(trial))
    header = RecordingHeader("cell", cell.name, {"timestep": "1/500", "versions": versions()})
    recorder = Recorder(cell, path, header)
    client = Client(InProcess(cell, node="/worker"))
    work(client)
    client.close()
    recorder.end({"outcome": "done"})
    return path


def short_work(client: Client) -> None:
    """Start the competition, move the arm a little, and be refused once."""
    client.start_competition()
    client.wait_for_order(timeout=1.0)
    client.sleep(0.5)
    client.send_arm([[1.76, 0.28, -1.38, 1.5, 3.27, -1.51, 0.0]], times=[1.0])
    client.sleep(1.5)
    client.control_gripper(True)
    client.sleep(1.0)
