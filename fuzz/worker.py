"""Process of the search of one target: `python -m fuzz.worker TARGET SECONDS FOLDER`.

An unexpected exception is kept once, with its input, and the search goes on. A hang, a crash of a library or too much
memory end the process, and libFuzzer keeps the input. `FOLDER` gets `corpus`, `findings` and `executions`.
"""

from __future__ import annotations

import hashlib
import os
import random
import signal
import sys
import traceback
import warnings
from pathlib import Path
from types import FrameType

import atheris

from fuzz.target import Target

MAX_PROCESSOR_TIME = 20
"""Processor time [s] above which an input is a finding; the machine may have other work."""
MAX_WALL_TIME = 120
"""Wall time [s] after which an input ends the process: something waits for ever."""
MAX_MEMORY = 2000
"""Memory [MiB] above which a process is stopped."""
READERS = ["cellwright", "yaml", "xacro", "rosbags"]
"""Packages whose branches lead the search."""


class SlowError(Exception):
    """An input took too long."""


class Search:
    """Gives inputs to a target and keeps those that break it."""

    def __init__(self, target: Target, folder: Path) -> None:
        self.target = target
        self._findings = folder / "findings"
        self._findings.mkdir(parents=True, exist_ok=True)
        self._known = {path.name.partition(".")[0] for path in self._findings.glob("*.txt")}

    def one(self, data: bytes) -> None:
        """Try one input."""
        signal.setitimer(signal.ITIMER_PROF, MAX_PROCESSOR_TIME)
        try:
            self.target.attempt(data)
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:
            self._keep(data, error)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)

    def mutator(self, data: bytes, max_length: int, seed: int) -> bytes:
        """Return another input of the same kind; once in a while of any kind."""
        chance = random.Random(seed)
        changed = self.target.mutate(data, chance) if self.target.mutate and chance.random() < 0.9 else None
        if changed is None or len(changed) > max_length:
            changed = atheris.Mutate(data, max_length)
        return bytes(changed[:max_length])

    def _keep(self, data: bytes, error: BaseException) -> None:
        """Keep an input whose traceback ends at a new place."""
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if "cellwright" in frame.filename or "fuzz" in frame.filename] or frames
        where = f"{type(error).__name__} {own[-1].filename}:{own[-1].lineno}"
        key = hashlib.sha256(where.encode()).hexdigest()[:12]
        if key in self._known:
            return
        self._known.add(key)
        (self._findings / f"{key}.input").write_bytes(data)
        text = "".join(traceback.format_exception(error, limit=-12))
        (self._findings / f"{key}.txt").write_text(f"{where}\n{text}", encoding="utf-8", errors="replace")


def _too_slow(_signal: int, _frame: FrameType | None) -> None:
    raise SlowError(f"more than {MAX_PROCESSOR_TIME} s of the processor")


def main() -> None:
    """Search for the requested time."""
    name, seconds, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    with atheris.instrument_imports(include=READERS):
        from fuzz.target import find

        target = find(name)
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGPROF, _too_slow)
    corpus = folder / "corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    for content in target.seeds():
        if len(content) <= target.max_size:
            (corpus / hashlib.sha256(content).hexdigest()[:20]).write_bytes(content)
    dictionary = folder / "words.dict"
    dictionary.write_text("".join(f'"{_escaped(word)}"\n' for word in target.words if word), encoding="ascii")
    search = Search(target, folder)
    options = [
        f"-max_total_time={seconds}",
        f"-max_len={target.max_size}",
        f"-dict={dictionary}",
        f"-timeout={MAX_WALL_TIME}",
        f"-report_slow_units={MAX_WALL_TIME}",
        f"-rss_limit_mb={MAX_MEMORY}",
        f"-artifact_prefix={folder / 'findings'}{os.sep}",
        "-print_final_stats=1",
        "-reload=0",
        str(corpus),
    ]
    mutator = {"custom_mutator": search.mutator} if target.mutate else {}
    atheris.Setup([sys.argv[0], *options], search.one, **mutator)
    atheris.Fuzz()


def _escaped(word: str) -> str:
    return "".join(f"\\x{byte:02x}" for byte in word.encode("utf-8", "replace"))


if __name__ == "__main__":
    main()
