"""Records of runs that were never run."""

from kitting.evaluate import RunRecord


def record(task: str, seed: int, *, success: bool = False) -> RunRecord:
    """Return the record of a run that has succeeded after 4 s, or has not until 20 s."""
    outcome, error = ("done", "none") if success else ("time_limit", "policy")
    return RunRecord(task, seed, success, 4.0 if success else 20.0, 1.5, outcome, error, f"{seed:064x}")
