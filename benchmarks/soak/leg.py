"""One process of a long run: from one border between two rounds to another, reporting in lines of JSON.

Lines: `sample` [hours, MiB] after each round, `cut` [round, state hash] at each cut, and at the end `grown`
(growth of Python's objects, if that was traced) and `counts`.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import threading
import tracemalloc
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.soak.face import ROUND, Face
from benchmarks.soak.memory import resident
from cellwright.engine.snapshot import read_checkpoint, renew_engine, write_checkpoint

Report = Callable[[str, Any], None]

HOUR = 3_600_000_000_000
"""[ns]"""
FACES = ("cell", "robot")
_MAX_LINES = 8  # of code that has grown most


@dataclass(frozen=True, slots=True)
class Leg:
    """Work of a process.

    Attributes:
        face: one of `FACES`.
        begin: first round.
        end: round that it ends before.
        cuts: borders at which the run is saved and restored, by the number of the round that follows.
        start: checkpoint to begin from; empty: from the beginning.
        save: checkpoint to write at the last cut; empty: none is written, though the run is touched alike.
        everything: listen to every topic.
        traced: trace Python's objects, which takes time.
    """

    face: str
    begin: int
    end: int
    cuts: tuple[int, ...] = ()
    start: str = ""
    save: str = ""
    everything: bool = False
    traced: bool = False

    def to_json(self) -> str:
        """Return it as text, for a command line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Leg:
        """Return the leg of a text by `to_json`."""
        values = json.loads(text)
        return cls(**{**values, "cuts": tuple(values["cuts"])})


def make_face(name: str, *, everything: bool) -> Face:
    """Return the cell or the robot; the other one is not loaded."""
    if name == "cell":
        from benchmarks.soak.cell_face import CellFace

        return CellFace(everything=everything)
    from benchmarks.soak.robot_face import RobotFace

    return RobotFace(everything=everything)


def run_leg(leg: Leg, report: Report) -> None:
    """Run the rounds of a leg.

    Raises:
        CheckpointError: the checkpoint to begin from cannot be read.
    """
    was_tracing = tracemalloc.is_tracing()
    try:
        _run_leg(leg, report)
    finally:
        if not was_tracing:
            tracemalloc.stop()  # traced, all Python of this process takes several times as long


def _run_leg(leg: Leg, report: Report) -> None:
    face = make_face(leg.face, everything=leg.everything)
    if leg.start:
        read_checkpoint(face.simulation, Path(leg.start))
    else:
        face.begin()
    first = None
    warm = leg.begin + max(1, (leg.end - leg.begin) // 4)  # by then all has been used once
    for number in range(leg.begin, leg.end):
        if leg.traced and number == warm:
            first = _objects()
        face.work(number)
        report("sample", [(number + 1) * ROUND / HOUR, resident()])
        if number + 1 in leg.cuts:
            if leg.save and number + 1 == max(leg.cuts):
                write_checkpoint(face.simulation, Path(leg.save))
            else:
                renew_engine(face.simulation)
            report("cut", [number + 1, face.simulation.state_hash()])
    if first is not None:
        changes = _objects().compare_to(first, "lineno")
        places = [f"{each.size_diff / 1024:+.1f} KiB {_place(each)}" for each in changes[:_MAX_LINES]]
        report("grown", [sum(each.size_diff for each in changes) / 1024, places])
    report("counts", dict(face.counts))


def _objects() -> tracemalloc.Snapshot:
    if not tracemalloc.is_tracing():
        tracemalloc.start()
    gc.collect()
    return tracemalloc.take_snapshot().filter_traces([tracemalloc.Filter(False, tracemalloc.__file__)])


def _place(change: tracemalloc.StatisticDiff) -> str:
    frame = change.traceback[0]
    return f"{Path(frame.filename).name}:{frame.lineno}"


def main() -> None:
    """Run the leg that the first argument describes, until its stdin ends with the process that started it."""
    threading.Thread(target=_end_with_stdin, daemon=True).start()

    def report(kind: str, value: Any) -> None:
        sys.stdout.write(json.dumps({kind: value}) + "\n")
        sys.stdout.flush()

    run_leg(Leg.from_json(sys.argv[1]), report)
    sys.stdout.flush()
    os._exit(0)


def _end_with_stdin() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


if __name__ == "__main__":
    main()
