"""`python -m benchmarks.soak`: ten simulated hours of a cell and of a robot, with checks."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.soak.face import ROUND
from benchmarks.soak.leg import FACES, HOUR
from benchmarks.soak.report import has_passed, lines, picture
from benchmarks.soak.soak import SoakError, soak
from cellwright.util.files import write_atomic

_MAX_HOURS = 1000.0  # [h]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status.

    Args:
        arguments: the command's arguments; None takes those of the process.

    Returns:
        0: memory is steady and the states are equal; 1: they are not, or a process ended; 2: bad input.
    """
    options = _parser().parse_args(arguments)
    if not ROUND / HOUR <= options.hours <= _MAX_HOURS:
        return _refuse(f"--hours {options.hours:g}: must be from {ROUND / HOUR:g} (one round) to {_MAX_HOURS:g}")
    if options.pieces < 1:
        return _refuse(f"--pieces {options.pieces}: must be at least 1")
    if options.picture is not None and not options.picture.absolute().parent.is_dir():
        return _refuse(f"--picture {options.picture}: there is no folder {options.picture.parent}")
    rounds = round(options.hours * HOUR / ROUND)
    runs = []
    try:
        with tempfile.TemporaryDirectory(prefix="cellwright-endurance-") as folder:
            for face in [options.face] if options.face else FACES:
                _print(f"{face}: {options.hours:g} simulated hours in one process, and in {options.pieces} pieces")
                runs.append(
                    soak(face, rounds, options.pieces, Path(folder), everything=options.everything, on_progress=_print)
                )
    except SoakError as error:
        sys.stderr.write(f"error: {error}\n")
        return 1
    for run in runs:
        _print("\n" + "\n".join(lines(run)))
    if options.picture is not None:
        try:
            write_atomic(options.picture, picture(runs))
        except OSError as error:
            sys.stderr.write(f"error: {options.picture}: cannot be written: {error.strerror}\n")
            return 1
        _print(f"\npicture  {options.picture}")
    return 0 if all(map(has_passed, runs)) else 1


def _parser() -> argparse.ArgumentParser:
    words = (
        "Run a cell and a robot for simulated hours in one process, and the same in pieces, each in a new process "
        "from a checkpoint. Memory must stay flat, and the states must be equal at every cut."
    )
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak", description=words)
    parser.add_argument("--hours", type=float, default=10.0, help="simulated hours (10)")
    parser.add_argument("--pieces", type=int, default=10, help="number of pieces of the second run (10)")
    parser.add_argument("--face", choices=FACES, help="run only this one (default: both, one after the other)")
    parser.add_argument("--everything", action="store_true", help="subscribe to every topic instead of some")
    parser.add_argument("--picture", type=Path, metavar="FILE.svg", help="file for a picture of memory over time")
    return parser


def _refuse(words: str) -> int:
    sys.stderr.write(f"error: {words}\n")
    return 2


def _print(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
