"""A long run and the same run in pieces, side by side: two processes, of which the second restarts at each cut."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.soak.face import ROUND
from benchmarks.soak.leg import HOUR, Leg
from benchmarks.soak.memory import Growth, Sample, growth
from cellwright.util.errors import CellwrightError

TRACED = 16
"""Rounds in which Python's objects are traced."""


class SoakError(CellwrightError):
    """A process of a long run ended before it was over."""


@dataclass
class SoakResult:
    """Result of a long run of one face.

    Attributes:
        face: its name.
        rounds: number of rounds.
        wall: wall time [s].
        samples: memory of the process that ran it in one piece.
        whole: state hash at each cut, by round, of the run in one piece.
        pieces: the same of the run in pieces.
        counts: actions and messages, in one piece.
        grown: growth of Python's objects in `TRACED` rounds [KiB]; None if it was not traced.
        max_growth: code with the largest growth.
    """

    face: str
    rounds: int
    wall: float = 0.0
    samples: list[Sample] = field(default_factory=list)
    whole: dict[int, str] = field(default_factory=dict)
    pieces: dict[int, str] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    grown: float | None = None
    max_growth: tuple[str, ...] = ()

    @property
    def hours(self) -> float:
        """Simulation time [h]."""
        return self.rounds * ROUND / HOUR

    @property
    def growth(self) -> Growth:
        """Growth of memory."""
        return growth(self.samples)

    @property
    def first_difference(self) -> int | None:
        """First cut at which the two runs are in different states, by round; None if there is none."""
        return next((cut for cut, seen in self.whole.items() if self.pieces.get(cut) != seen), None)


def borders(rounds: int, pieces: int) -> tuple[int, ...]:
    """Return the borders of pieces as equal as possible, from 0 to `rounds`; at most one piece per round."""
    pieces = min(pieces, rounds)
    return tuple(number * rounds // pieces for number in range(pieces + 1))


def soak(
    face: str,
    rounds: int,
    pieces: int,
    folder: Path,
    *,
    everything: bool = False,
    traced: int = TRACED,
    on_progress: Callable[[str], None] = lambda _line: None,
) -> SoakResult:
    """Run a face for long, in one piece and in pieces at the same time.

    Args:
        face: `cell` or `robot`.
        rounds: number of rounds.
        pieces: number of pieces.
        folder: for the checkpoints.
        everything: listen to every topic.
        traced: rounds of a third, short run in which Python's objects are traced; 0: none.
        on_progress: takes a line now and then about the progress.

    Raises:
        SoakError: a process ended before it was over.
    """
    found = SoakResult(face, rounds)
    cuts = borders(rounds, pieces)
    begun = time.monotonic()

    def take(kind: str, value: Any) -> None:
        if kind == "sample":
            found.samples.append(Sample(*value))
        elif kind == "cut":
            found.whole[value[0]] = value[1]
            spent = time.monotonic() - begun
            on_progress(
                f"{face}: {found.samples[-1].hours:.2f} of {found.hours:g} h, {spent:.0f} s, state {value[1][:12]}"
            )
        elif kind == "counts":
            found.counts.update(value)

    def take_of_piece(kind: str, value: Any) -> None:
        if kind == "cut":
            found.pieces[value[0]] = value[1]

    def take_growth(kind: str, value: Any) -> None:
        if kind == "grown":
            found.grown, found.max_growth = value[0], tuple(value[1])

    def in_pieces() -> None:
        start = ""
        for begin, end in pairwise(cuts):
            save = str(folder / f"{face}-{end}.npz")
            _run(Leg(face, begin, end, (end,), start, save, everything=everything), take_of_piece)
            start = save

    def in_one_piece() -> None:
        _run(Leg(face, 0, rounds, cuts[1:], everything=everything), take)
        found.wall = time.monotonic() - begun

    _side_by_side([in_one_piece, in_pieces])
    if traced:
        _run(Leg(face, 0, traced, everything=everything, traced=True), take_growth)
    return found


def _run(leg: Leg, take: Callable[[str, Any], None]) -> None:
    process = subprocess.Popen(  # noqa: S603 (this program, with arguments of ours)
        [sys.executable, "-m", "benchmarks.soak.leg", leg.to_json()],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    )
    with process:
        try:
            for line in process.stdout or ():
                for kind, value in json.loads(line).items():
                    take(kind, value)
        except BaseException:
            process.kill()
            raise
        if process.stdin is not None:
            process.wait()
    if process.returncode:
        raise SoakError(f"{leg.face}: rounds {leg.begin} to {leg.end}: exit status {process.returncode}")


def _side_by_side(works: Sequence[Callable[[], None]]) -> None:
    """Run functions at the same time; when all are over, raise the error of one."""
    raised: list[BaseException] = []

    def guarded(work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as error:
            raised.append(error)

    threads = [threading.Thread(target=guarded, args=(work,)) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if raised:
        raise raised[0]
