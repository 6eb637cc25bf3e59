"""State hashes of the bundled trials and tasks worked by `kitter`: refactoring leaves each as it is.

In tasks of a robot, which `kitter` does not work, its joints sway.

`python -m tests.state_hashes` runs all trials, or the named ones, and compares them with the file; with `--write`, it
writes the file. Beside each hash the file has a digest of the motion: positions and velocities of all joints alone, by
name. A fixed post far away, or bins in another order, move the hash and leave the motion as it is.
"""

import hashlib
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import mujoco
import numpy as np

from cellwright import Cell, load_trial
from cellwright.clients.agents.agent import find_agent
from cellwright.config.trial.catalogue import bundled, bundled_tasks, find_trial
from cellwright.envs.stepper import CellStepper
from cellwright.running.run import RunOptions, run_cell

FILE = Path(__file__).parent / "data" / "state_hashes.json"
UNTIL = 600.0  # [s]
SWAYS = 60
"""Control periods of 50 ms in which a robot sways."""

_SIZES = {mujoco.mjtJoint.mjJNT_FREE: (7, 6), mujoco.mjtJoint.mjJNT_BALL: (4, 3)}
"""Numbers of a joint in `qpos` and in `qvel`, if they are not one."""


def kept() -> dict[str, dict[str, object]]:
    """Return the file's content, by trial."""
    hashes: dict[str, dict[str, object]] = json.loads(FILE.read_text())
    return hashes


def motion(cell: Cell) -> str:
    """Return the SHA-256 of positions and velocities of all joints, sorted by name."""
    model, data = cell.simulation.model, cell.simulation.data
    digest = hashlib.sha256()
    for name, joint in sorted((model.joint(joint).name, joint) for joint in range(model.njnt)):
        positions, velocities = _SIZES.get(model.jnt_type[joint], (1, 1))
        qpos, dof = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        digest.update(name.encode())
        # the sum has no negative zeros
        digest.update((data.qpos[qpos : qpos + positions] + 0.0).tobytes())
        digest.update((data.qvel[dof : dof + velocities] + 0.0).tobytes())
    return digest.hexdigest()


def measured(trial: str) -> dict[str, object]:
    """Return outcome, points, state hash and motion of a bundled trial; those of 2017 get sensors of `kitter`."""
    sensors = [] if trial in ("lesson", *bundled_tasks()) else [find_trial("kitter_sensors")]
    cell = Cell(load_trial(find_trial(trial), *sensors))
    if not cell.trial.arms:
        return _swayed(cell)
    result = run_cell(cell, find_agent("kitter")(), RunOptions(until=UNTIL))
    return {
        "outcome": str(result.outcome),
        "points": result.score.total if result.score else None,
        "state_hash": result.state_hash,
        "motion": motion(cell),
    }


def _swayed(cell: Cell) -> dict[str, object]:
    stepper = CellStepper(cell)
    first = np.array(stepper.read())
    for step in range(SWAYS):
        stepper.step(first + 0.2 * np.sin(0.3 * step + np.arange(len(first))))
    score = float(cell.competition.score().total)
    return {"outcome": "swayed", "points": score, "state_hash": cell.state_hash(), "motion": motion(cell)}


def verdict(found: dict[str, object], expected: dict[str, object] | None) -> str:
    """Return how a trial compares with the file: "same", what differs with the same motion, or "DIFFERENT"."""
    if expected is None or found["motion"] != expected["motion"]:
        return "DIFFERENT"
    differing = [name for name in found if found[name] != expected[name]]
    return f"same motion, DIFFERENT {' and '.join(differing)}" if differing else "same"


def main(arguments: list[str]) -> int:
    """Run trials on two cores; return 1 if one differs."""
    trials = [trial for trial in arguments if not trial.startswith("-")] or [*bundled(), *bundled_tasks()]
    found: dict[str, dict[str, object]] = {}
    with ProcessPoolExecutor(2) as pool:
        for trial, figures in zip(trials, pool.map(measured, trials), strict=True):
            print(trial, *figures.values(), verdict(figures, kept().get(trial)), flush=True)
            found[trial] = figures
    differing = [trial for trial in trials if found[trial] != kept().get(trial)]
    if "--write" in arguments:
        FILE.write_text(json.dumps({**kept(), **found}, indent=1) + "\n")
    print(f"{len(trials) - len(differing)} of {len(trials)} as in {FILE.name}", *differing, sep="\n")
    return bool(differing)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
