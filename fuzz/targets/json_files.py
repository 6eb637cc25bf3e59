"""JSON files that Cellwright writes and reads: results of an evaluation, recorded motions, logs of runs."""

from __future__ import annotations

import json
import random
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.robot.checks.reference import read_reference
from cellwright.running.evaluation.outputs.junit import junit
from cellwright.running.evaluation.outputs.report import report
from cellwright.running.evaluation.results.folder import RESULTS_NAME
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.running.evaluation.results.seal import sealed
from cellwright.running.evaluation.results.summary import summary_document
from cellwright.util.errors import UsageError
from cellwright.util.files import read_json_lines
from fuzz import seeds as bundled
from fuzz.trees import mutated
from fuzz.verdict import check_lines

MAX_SIZE = 12_000
WORDS = (
    "key",
    "trial",
    "agent",
    "seed",
    "outcome",
    "points",
    "score",
    "timeline",
    "log",
    "samples",
    "steps",
    "sines",
    "NaN",
)
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))


def seeds() -> Iterator[bytes]:
    """Yield a result, and a recorded motion."""
    result = Result("k", "lesson", "none", 1, False, "done", 1.0, 8.0, 12.0, 3.0, log=("a",), command="cellwright run")
    yield json.dumps(result.as_json()).encode() + b"\n"
    motion = {
        "joints": ["a"],
        "steps_per_second": 240,
        "hands": [{"link": "h", "position": [0, 0, 0], "orientation": [0, 0, 0, 1]}],
        "grippers": [{"joints": ["g"], "positions": [{"status": 0.5, "joints": [0.1]}]}],
        "closing": [{"gripper": 0, "status": 1, "samples": [[0, 0], [1, 0.5]]}],
        "steps": [{"joint": "a", "start": 0, "target": 1, "samples": [[0, 0], [1, 1]]}],
        "sines": [{"joint": "a", "rate": 30, "samples": [[0, 0, 0], [1, 1, 1]]}],
    }
    yield json.dumps(motion).encode()
    yield from bundled.files("tests/data/scorer_cases.json", max_size=MAX_SIZE)


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another document."""
    try:
        return json.dumps(mutated(json.loads(data), chance, WORDS), default=str).encode() + b"\n"
    except (ValueError, TypeError, RecursionError):
        return None


def attempt(data: bytes) -> None:
    """Read the bytes as every JSON format; make a report of valid results."""
    path = _FOLDER / "motion.json"
    path.write_bytes(data)
    try:
        read_reference(path)
    except UsageError as error:
        check_lines([error], [str(path)])
    read_json_lines(path)
    folder = _FOLDER / "evaluation"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    line = data.strip()
    whole = (
        sealed(line.decode(errors="replace")) + b"\n" if line.endswith(b"}") else b""
    )  # else its seal is refused alone
    (folder / RESULTS_NAME).write_bytes(data + whole)
    try:
        with ResultsFile(folder) as results:
            found = list(results.results.values())
    except UsageError as error:
        check_lines([error], [str(folder / RESULTS_NAME)])
        return
    for result in found:
        json.dumps(result.as_json(), allow_nan=False)
    report(found, None)
    junit(found, None)
    json.dumps(summary_document(found, None, 0), allow_nan=False)
