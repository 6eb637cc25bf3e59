"""The whole path: accepted trials are built, compiled by the engine, and run for fifty steps."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.models.files import ModelFileError
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import DescriptionError, SimulationError
from fuzz import seeds as bundled
from fuzz.targets import trial

MAX_SIZE = trial.MAX_SIZE
WORDS = trial.WORDS
mutate = trial.mutate
_PATH = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-")) / "trial.yaml"


def seeds() -> Iterator[bytes]:
    """Yield the smaller trials, which are built faster."""
    yield from bundled.files(*bundled.TRIALS, max_size=1800)
    yield from bundled.files("docs/examples/own_models/own_models.yaml")


def attempt(data: bytes) -> None:
    """Load, build, start the competition, and run fifty ticks with a listener on every topic."""
    _PATH.write_bytes(data)
    try:
        loaded = load_trial([_PATH])
    except DescriptionError:
        return
    with contextlib.suppress(ModelFileError, SimulationError):
        run(Cell(loaded.trial))


def run(cell: Cell) -> None:
    """Run fifty ticks of a competition, and read its score."""
    for name in cell.topics():
        cell.bus.subscribe(name, lambda _message: None, node="/listener")
    client = Client(InProcess(cell))
    client.start_competition()
    for _ in range(50):
        cell.step()
    cell.state_hash()
    cell.competition.score()
