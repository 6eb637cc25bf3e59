"""State hashes of the bundled trials worked by `kitter`: refactoring leaves each as it is.

`python -m tests.state_hashes` runs all trials, or the named ones, and compares them with the file; with `--write`, it
writes the file.
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from cellwright import Cell, load_trial
from cellwright.clients.agents.agent import find_agent
from cellwright.config.trial.catalogue import bundled, find_trial
from cellwright.running.run import RunOptions, run_cell

FILE = Path(__file__).parent / "data" / "state_hashes.json"
UNTIL = 600.0  # [s]


def kept() -> dict[str, dict[str, object]]:
    """Return the file's content, by trial."""
    hashes: dict[str, dict[str, object]] = json.loads(FILE.read_text())
    return hashes


def measured(trial: str) -> dict[str, object]:
    """Return outcome, points and state hash of `kitter` in a bundled trial (those of 2017 with its sensors)."""
    sensors = [] if trial == "lesson" else [find_trial("kitter_sensors")]
    result = run_cell(Cell(load_trial(find_trial(trial), *sensors)), find_agent("kitter")(), RunOptions(until=UNTIL))
    return {
        "outcome": str(result.outcome),
        "points": result.score.total if result.score else None,
        "state_hash": result.state_hash,
    }


def main(arguments: list[str]) -> int:
    """Run trials on two cores; return 1 if one differs."""
    trials = [trial for trial in arguments if not trial.startswith("-")] or list(bundled())
    found: dict[str, dict[str, object]] = {}
    with ProcessPoolExecutor(2) as pool:
        for trial, figures in zip(trials, pool.map(measured, trials), strict=True):
            print(trial, *figures.values(), "same" if figures == kept().get(trial) else "DIFFERENT", flush=True)
            found[trial] = figures
    if "--write" in arguments:
        FILE.write_text(json.dumps({**kept(), **found}, indent=1) + "\n")
    differing = [trial for trial in trials if found[trial] != kept().get(trial)]
    print(f"{len(trials) - len(differing)} of {len(trials)} as in {FILE.name}", *differing, sep="\n")
    return bool(differing)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
