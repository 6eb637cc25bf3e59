"""Searches target after target, and prints a table of executions, coverage and findings.

Exit status: 0 without findings, 1 with any.
"""

from __future__ import annotations

import argparse
import re
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec

from fuzz import target as targets
from fuzz.seeds import ROOT

FOLDER = ROOT / ".fuzz"
"""Folder of the inputs that later searches begin with; git ignores it."""
MAX_MEMORY = 6 << 30
"""Address space of a search [bytes], so that a runaway search does no harm outside."""
MAX_DEATHS = 5
"""Process deaths after which a target is given up."""


@dataclass
class SearchResult:
    """Result of a target."""

    executions: int = 0
    coverage: int = 0
    deaths: int = 0
    findings: int = 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Search, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of: {', '.join(targets.names())}; default: all")
    parser.add_argument("--seconds", type=int, default=60, help="for each target (default: %(default)s)")
    chosen = parser.parse_args(arguments)
    unknown = set(chosen.targets) - set(targets.names())
    if unknown:
        parser.error(f"unknown target {', '.join(sorted(unknown))} (known: {', '.join(targets.names())})")
    if find_spec("atheris") is None:
        parser.error("atheris is not installed; it has wheels for Python 3.11 on Linux (x86-64) alone")
    found = 0
    print(f"{'target':<14}{'executions':>12}{'coverage':>10}{'findings':>10}", flush=True)
    for name in chosen.targets or targets.names():
        tally = search(name, chosen.seconds)
        found += tally.findings
        print(f"{name:<14}{tally.executions:>12}{tally.coverage:>10}{tally.findings:>10}", flush=True)
    if found:
        print(f"inputs and tracebacks are in {FOLDER}/TARGET/findings; see CONTRIBUTING.md for what to do with them")
    return 1 if found else 0


def search(name: str, seconds: int) -> SearchResult:
    """Search one target; restart a process that ends before its time."""
    folder = FOLDER / name
    folder.mkdir(parents=True, exist_ok=True)
    tally = SearchResult()
    end = time.monotonic() + seconds
    while (left := int(end - time.monotonic())) > 0 and tally.deaths < MAX_DEATHS:
        with (folder / "log.txt").open("w+b") as log:
            command = [sys.executable, "-m", "fuzz.worker", name, str(left), str(folder)]
            done = subprocess.run(
                command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=log, stderr=log, preexec_fn=_limited, check=False
            )
        text = (folder / "log.txt").read_text("utf-8", errors="replace")
        tally.executions += sum(map(int, re.findall(r"^stat::number_of_executed_units:\s*(\d+)", text, re.MULTILINE)))
        tally.coverage = max([tally.coverage, *map(int, re.findall(r"\bcov: (\d+)", text))])
        if done.returncode != 0:
            tally.deaths += 1
            (folder / f"death-{tally.deaths}.txt").write_text(text[-20_000:], encoding="utf-8")
    kept = sum(path.suffix != ".input" for path in (folder / "findings").glob("*"))
    tally.findings = max(kept, min(1, tally.deaths))  # a process that dies has a finding, if only its death
    return tally


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))


if __name__ == "__main__":
    sys.exit(main())
