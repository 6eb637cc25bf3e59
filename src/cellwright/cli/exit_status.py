"""Exit statuses of the command line: what a script may rely on."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cellwright.running.run import RunResult

DONE = 0
"""What was asked for is done."""
NOT_DONE = 1
"""It was started and not done: time limit, --until came first, agent gave up or crashed, below --min-score,
interrupted."""
BAD_INPUT = 2
"""The input cannot be used; nothing has been started."""


def of_run(result: RunResult, *, has_agent: bool, min_score: float | None) -> int:
    """The exit status of a run.

    Args:
        result: what came of it.
        has_agent: without one, a run is done when it has reached the time that was asked for.
        min_score: the score that was asked for, if any.
    """
    from cellwright.running.run import Outcome  # it takes long to load, and other commands need the figures above alone

    if min_score is not None and result.score.total < min_score:
        return NOT_DONE
    is_done = result.outcome is Outcome.DONE or (result.outcome is Outcome.UNTIL and not has_agent)
    return DONE if is_done else NOT_DONE
