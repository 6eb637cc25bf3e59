"""Reports of an agent's process, which the agent may have forged."""

from __future__ import annotations

import json
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.running.remote.hosting import read_report
from cellwright.running.remote.program import REFUSED, AgentExit, ExitReason
from fuzz.trees import mutated
from fuzz.verdict import FindingError

MAX_SIZE = 4_000
WORDS = ("parting", "error", REFUSED, *ExitReason)
_FILE = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-")) / "report.json"


def seeds() -> Iterator[bytes]:
    """Yield a report of each kind."""
    for parting in (REFUSED, *ExitReason):
        yield json.dumps({"parting": parting, "error": "KeyError: 'x'\n"}).encode()


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another document."""
    try:
        return json.dumps(mutated(json.loads(data), chance, WORDS), default=str).encode()
    except (ValueError, TypeError, RecursionError):
        return None


def attempt(data: bytes) -> None:
    """Read the bytes as a report: the agent's end, the failure of its construction, or nothing."""
    _FILE.write_bytes(data)
    said = read_report(_FILE)
    text = said.error if isinstance(said, AgentExit) else said
    if not text.replace("\n", "").replace("\t", "").isprintable():
        raise FindingError(f"a text that a terminal cannot show: {text!r:.200}")
