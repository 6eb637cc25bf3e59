"""Outcomes of the frames of a cell's run: reward, success and end, by its task, or by its score without one."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import CompetitionState, EndReason
from cellwright.recording.dataset.episode import Column


class FrameOutcome(NamedTuple):
    """Outcome of a frame, as of its end.

    Attributes:
        reward: its reward.
        is_success: True if the work is done.
        is_terminated: True if it is done, or the competition is over before the time limit.
        is_over: True if the episode ends here.
    """

    reward: float
    is_success: bool
    is_terminated: bool
    is_over: bool


class Outcomes:
    """Outcomes of the frames of a cell's run; create it at the begin, and read it at the end of each frame.

    With a task, the reward is 1 in the frame of the first success, with which the episode ends. Before, it is 0, or the
    potential if the reward is shaped. A success is seen each 20 ms, as in a run. Without a task, the reward is what the
    frame gained in points, and the success that all orders are complete.

    Args:
        cell: the cell.

    Example:
        >>> from cellwright import load_trial
        >>> cell = Cell(load_trial("pick_from_bin"))
        >>> outcomes = Outcomes(cell)
        >>> cell.step()
        >>> outcomes.read().is_success
        False
    """

    def __init__(self, cell: Cell) -> None:
        self._cell, self._points = cell, cell.competition.score().total
        if cell.task is not None:
            cell.task.watch()

    def read(self) -> FrameOutcome:
        """Return the outcome of the frame that ends now."""
        competition, task = self._cell.competition, self._cell.task
        is_over = competition.state is CompetitionState.DONE
        if task is None:
            before, self._points = self._points, competition.score().total
            reward = self._points - before
            is_success = competition.referee.end_reason is EndReason.ORDERS_COMPLETE
        else:
            is_success = task.succeeded_at is not None
            # not `task.reward()`, which looks at the conditions and so moves the begin of a `hold_for`
            reward = 1.0 if is_success else task.potential() if task.task.reward == "shaped" else 0.0
        is_terminated = is_success or (is_over and not competition.is_timed_out)
        return FrameOutcome(reward, is_success, is_terminated, is_success or is_over)


def outcome_columns(count: int, outcomes: Sequence[FrameOutcome]) -> Iterator[Column]:
    """Yield the columns of what frames come to: `next.done`, `next.truncated`, and of judged ones reward and success.

    Args:
        count: number of frames.
        outcomes: one for each; none where nothing judges, as at a robot's node.

    Example:
        >>> [column.name for column in outcome_columns(2, [])]
        ['next.done', 'next.truncated']
    """
    if outcomes:
        yield Column("next.reward", np.array([each.reward for each in outcomes], np.float32), ())
        yield Column("next.success", np.array([each.is_success for each in outcomes], np.bool_), ())
    done = np.arange(count) == count - 1
    yield Column("next.done", done, ())
    is_terminated = bool(outcomes) and outcomes[-1].is_terminated
    yield Column("next.truncated", done & (not is_terminated), ())
