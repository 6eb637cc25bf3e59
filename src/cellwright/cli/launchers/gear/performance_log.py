"""The log of a trial at `~/.ariac/log/performance.log`: lines as things happen, and the score in a block at the end.

Scripts of the time look for the block that begins with `<game_score>`. Times are simulation time [s].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from cellwright.cell.kitting import effects
from cellwright.cell.kitting.kit_score import KitScore
from cellwright.cell.kitting.scorer import GameScore, OrderScore
from cellwright.engine.clock import seconds
from cellwright.util.files import LineFile


def log_path(home: Path) -> Path:
    """Where the log of a user lies."""
    return home / ".ariac" / "log" / "performance.log"


class PerformanceLog:
    """Writes the log of one trial. Each line is with the operating system at once.

    A file that cannot be written is told of once, and the cell goes on without it.

    Args:
        path: the file; it is begun anew.
        report: takes a line when it cannot be written.
    """

    def __init__(self, path: Path, report: Callable[[str], None]) -> None:
        self.path = path
        self._has_score = False
        self._file: LineFile | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_symlink():  # the original left one, which may lead nowhere by now
                path.unlink()
            self._file = LineFile(path, report=report)
        except OSError as error:
            report(f"{path}: there will be no score log: {error.strerror or error}")

    def effect(self, effect: effects.Effect, now: int) -> None:
        """Note what the referee did at the time `now` [ns]."""
        for line in _lines(effect):
            self._write(f"[{seconds(now):.3f}] {line}")
        if isinstance(effect, effects.TrialEnded):
            self.score(effect.score, effect.process_time)

    def score(self, score: GameScore, process_time: int) -> None:
        """Write the score, and how long the game took [ns], unless that has been done."""
        if not self._has_score:
            self._has_score = True
            self._write("\n".join(score_lines(score, process_time)))

    def close(self) -> None:
        """Write no more."""
        if self._file is not None:
            self._file.close()

    def _write(self, text: str) -> None:
        if self._file is not None:
            self._file.write(text)


def _lines(effect: effects.Effect) -> Iterator[str]:
    match effect:
        case effects.StateChanged(state):
            yield f"State: {state}"
        case effects.OrderAnnounced(order, reason, _):
            yield f"Announcing order: {order.order_id} ({reason})"
        case effects.KitSubmitted(tray_id, kit_type, score, _):
            yield f"Submitted tray: {tray_id} as {kit_type}: [{score.total:g}]"
            if score.refusal is not None:
                yield score.refusal.sentence()
        case effects.OrderCompleted(score, _):
            yield f"Order complete: {score.order_id}: [{score.total:g}]"
        case effects.TrialEnded(reason, _, _):
            yield f"Trial over: {reason}"


def score_lines(score: GameScore, process_time: int) -> Iterator[str]:
    """The block of the score: the game, which took so long [ns], its orders, their kits."""
    yield "<game_score>"
    yield f"Total game score: [{score.total:g}]"
    yield f"Total process time: [{seconds(process_time):.3f}]"
    yield f"Part travel time: [{seconds(score.part_travel_time):.3f}]"
    for order in score.orders:
        yield from _order_lines(order)
    yield "</game_score>"


def _order_lines(order: OrderScore) -> Iterator[str]:
    yield f"<order_score {order.order_id}>"
    yield f"Total order score: [{order.total:g}]"
    yield f"Time taken: [{seconds(order.time_taken):.3f}]"
    yield f"Complete: [{_word(order.is_complete)}]"
    for kit in order.kits:
        yield from _kit_lines(kit)
    yield "</order_score>"


def _kit_lines(kit: KitScore) -> Iterator[str]:
    yield f"<kit_score {kit.kit_type}>"
    yield f"Total kit score: [{kit.total:g}]"
    yield f"Complete: [{_word(kit.is_complete)}]"
    yield f"Submitted: [{_word(kit.is_submitted)}]"
    yield f"Part presence score: [{kit.part_presence:g}]"
    yield f"All parts bonus: [{kit.all_parts_bonus:g}]"
    yield f"Part pose score: [{kit.part_pose:g}]"
    yield "</kit_score>"


def _word(truth: bool) -> str:  # noqa: FBT001
    return "true" if truth else "false"
