"""Summary of a run: progress while it lasts, then its score as a table and as a JSON document."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from cellwright.cell.cell import Cell
from cellwright.cell.kitting import effects
from cellwright.cell.kitting.evidence import (
    NOT_SUBMITTED,
    ON_ITS_WAY,
    REASONS,
    Evidence,
    KitEvidence,
    PartEvidence,
    evidence_to_json,
    trial_score_to_json,
)
from cellwright.cell.kitting.kit_score import BonusVerdict, Verdict
from cellwright.cell.kitting.scorer import TrialScore
from cellwright.cli.arguments import video_sentence
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.output import ShowProgress, print_entry, print_files, progress_bar, warn
from cellwright.cli.tables import FOLD, WHOLE, FittedTable, print_table, table
from cellwright.engine.clock import seconds
from cellwright.running.run import RunResult, versions
from cellwright.running.run.target import subscribe

if TYPE_CHECKING:
    from cellwright.running.run import Session
    from cellwright.running.run.observers import Pictures

_REDRAW = 0.1  # [s] of wall time
_PLAIN_LINE = 2.0  # [s] of wall time between plain lines, in output that goes to a file
_MAX_COLLISIONS = 5


class RunProgress:
    """Progress of a run on a console: an observer of its session.

    The actions of a cell's referee and log messages are lines that stay, with their simulation time.

    Args:
        until: the simulation time [s] at which the run stops, if any.
        status: returns the progress of a robot or a recording in a few words; None for a cell.
        verbose: print log messages of level INFO too, such as those of agents.
        is_served: time passes for clients; then only events are printed.
        clock: source of wall time [s], for tests.
    """

    def __init__(
        self,
        console: Console,
        *,
        until: float | None = None,
        status: Callable[[Session], str] | None = None,
        verbose: bool = False,
        is_served: bool = False,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._until, self._status, self._is_served = until, status, is_served
        self._console = console
        self._node: Any = None
        self._level = logging.INFO if verbose else logging.WARNING
        self._clock = clock
        self._shown = clock()
        self._since: tuple[float, float] | None = None  # wall time and simulation time at the first update
        self._bar: ShowProgress | None = None

    @contextmanager
    def __call__(self, session: Session) -> Iterator[None]:
        """Print the progress of a run."""
        self._node, self._since, status = session.node, None, self._status
        with ExitStack() as run:
            if status is not None:
                bar = run.enter_context(progress_bar(self._console, session.node.name, self._until))
                if bar is not None:
                    subscribe(session.on_poll, lambda: bar(session.node.simulation.time, status(session)), run)
                yield
                return
            run.enter_context(self.running(session.node))
            subscribe(session.node.competition.on_effect, self._print_effect, run)
            if not self._is_served:
                watch = session.node.simulation.watch("console", Fraction(1, 10), lambda _: self.update(session.node))
                run.callback(watch.cancel)
            yield

    @contextmanager
    def running(self, cell: Cell) -> Iterator[None]:
        """Print the events inside a cell."""
        self._node = cell
        limit = cell.trial.time_limit if self._until is None else self._until
        log, handler = logging.getLogger(), _LineHandler(self.line)
        level = log.level
        log.addHandler(handler)
        log.setLevel(self._level)
        self._shown = self._clock()
        try:
            with progress_bar(self._console, "simulating", limit) as self._bar:
                yield
        finally:
            self._bar = None
            log.removeHandler(handler)
            log.setLevel(level)

    def update(self, cell: Cell) -> None:
        """Show the progress of the cell, at most every 0.1 s of wall time."""
        now = self._clock()
        simulated = cell.simulation.time
        if self._since is None:
            self._since = now, simulated
            self._shown = now
            return
        if now - self._shown < (_REDRAW if self._bar else _PLAIN_LINE):
            return
        self._shown = now
        factor = f"{(simulated - self._since[1]) / (now - self._since[0]):.1f} x real time"
        state = cell.competition.state
        if self._bar is None:
            self.line(f"{factor}, {state}")
        else:
            self._bar(simulated, f"{simulated:.1f} s  {factor}  {state}")

    def notice(self, text: str) -> None:
        """Print a line that stays, in yellow; a warning before there is a run."""
        if self._node is None:
            warn(text)
        else:
            self.line(text, "yellow")

    def line(self, text: str, style: str | None = None) -> None:
        """Print a line that stays, with the simulation time once there is a run."""
        time = "" if self._node is None else f"{self._node.simulation.time:9.3f} s  "
        self._console.print(f"{time}{text}", markup=False, soft_wrap=True, style=style)

    def _print_effect(self, effect: effects.Effect) -> None:
        text = effect_sentence(effect)
        if text:
            self.line(text)


class _LineHandler(logging.Handler):
    """Logging handler that passes records on, a line at a time."""

    def __init__(self, on_message: Callable[[str], None]) -> None:
        super().__init__()
        self._on_message = on_message

    def emit(self, record: logging.LogRecord) -> None:
        for line in self.format(record).splitlines():
            self._on_message(line)


def effect_sentence(effect: effects.Effect) -> str:
    """Return an action of the referee in one sentence; empty for trivial ones."""
    match effect:
        case effects.StateChanged(state):
            return f"competition: {state}"
        case effects.OrderAnnounced(order, reason, interrupts):
            kits = ", ".join(kit.kit_type for kit in order.kits)
            tail = f"; {interrupts} waits" if interrupts else ""
            return f"announcing {order.order_id} ({reason}): {kits}{tail}"
        case effects.KitSubmitted(tray, kit_type, score, repeated):
            name = tray.rpartition("::")[0].rpartition("::")[2]
            if score.refusal is not None:
                return f"{name} submitted as {kit_type}: {score.refusal.sentence()}"
            again = " (submitted before: the first score counts)" if repeated else ""
            return f"{name} submitted as {kit_type}: {score.total:g} of {score.maximum:g} points{again}"
        case effects.OrderCompleted(score, resumes):
            tail = f"; {resumes} goes on" if resumes else ""
            return f"{score.order_id} is complete: {score.total:g} points in {score.time_taken / 1e9:.1f} s{tail}"
        case effects.TrialEnded(reason, score, _):
            return f"the trial is over ({reason}): {score.total:g} points"
        case _:
            return ""


def result_document(
    cell: Cell, agent: str, result: RunResult, status: int, pictures: Sequence[str], final: TrialScore | None = None
) -> dict[str, Any]:
    """Return a run's result; times in s. The `final` score is the trial's as in the finals, if averages are known."""
    return {
        "trial": cell.trial.name,
        "agent": agent,
        "seed": cell.seed,
        "servo": cell.servo,
        "circumstances": asdict(cell.trial.circumstances),
        "overrides": list(cell.trial.overrides),
        "timestep": float(Fraction(*cell.trial.settings.timestep)),
        "outcome": result.outcome.name.lower(),
        "exit_status": status,
        "error": result.error,
        "competition_state": result.competition_state,
        "success": result.success,
        "succeeded_at": result.succeeded_at,
        "simulated": result.simulated,
        "wall": result.wall,
        "real_time_factor": result.real_time_factor,
        "steps": result.steps,
        "state_hash": result.state_hash,
        "score": evidence_to_json(result.evidence)
        | {"trial_score": None if final is None else trial_score_to_json(final)},
        "collisions": [asdict(collision) for collision in result.collisions],
        "nearest_arms": result.nearest_arms and asdict(result.nearest_arms),
        "heard": result.heard,
        "refused": dict(cell.bus.refusals.counts),
        "pictures": list(pictures),
        "recordings": [str(path) for path in result.recordings],
        "versions": versions(),
    }


def with_files(status: int, cell: Cell, result: RunResult, pictures: Pictures) -> int:
    """Return the exit status, which is no longer 0 if a requested file is missing or not whole."""
    is_whole = result.is_complete and not pictures.missed and not cell.checkpoints.missed
    return status or (DONE if is_whole else NOT_DONE)


def take_picture(console: Console, pictures: Pictures, file: Path | None, cell: Cell) -> None:
    """Take a picture of the cell as it is; None for no picture."""
    if file is not None:
        with progress_bar(console, f"drawing {file}", 1.0) as show:
            pictures.take(file, cell, show)


def show_files(console: Console, result: RunResult, pictures: Pictures) -> None:
    """Print the written files, a line each."""
    print_files(console, "video", map(video_sentence, result.videos))
    print_files(console, "picture", pictures.written)
    print_files(console, "recording", result.recordings)


def show_result(console: Console, result: RunResult, final: TrialScore | None = None) -> None:
    """Print the result of a run: the score, how it ended, and the facts that reproduce it."""
    evidence, attainable = result.evidence, result.evidence.attainable
    for order in evidence.orders:
        for kit in order.kits:
            show_kit(console, order.score.order_id, kit)
    console.print()
    known = list(versions().items())
    lines = [
        ("outcome", str(result.outcome)),
        ("task", _task(result)),
        ("score", f"{evidence.total:g} of {evidence.attainable.maximum:g} points"),
        (
            "reachable",
            ""
            if attainable.total == attainable.maximum
            else f"{attainable.total:g} of {attainable.maximum:g}: see out of reach",
        ),
        *_times(evidence),
        ("sensors", f"cost {evidence.system_cost:g} $"),
        *(("finals", line) for line in _final(final)),
        *(("collision", collision.sentence()) for collision in result.collisions[:_MAX_COLLISIONS]),
        ("", f"and {more} more" if (more := len(result.collisions) - _MAX_COLLISIONS) > 0 else ""),
        ("nearest", "" if result.nearest_arms is None else result.nearest_arms.sentence()),
        ("simulated", f"{result.simulated:.1f} s in {result.wall:.1f} s: {result.real_time_factor:.1f} x real time"),
        ("state hash", result.state_hash),
        ("versions", ", ".join(f"{name} {version}" for name, version in known[:3])),
        ("", ", ".join(f"{name} {version}" for name, version in known[3:])),
        *((f"heard {count}", topic) for topic, count in sorted(result.heard.items())),
    ]
    for name, text in lines:
        if text:
            print_entry(console, name, text)


def _task(result: RunResult) -> str:
    """Return whether the task has succeeded, in words; empty without one."""
    if result.succeeded_at is not None:
        return f"succeeded at {result.succeeded_at:.2f} s"
    return "" if result.success is None else "not done"


def kit_table(kit: KitEvidence) -> FittedTable:
    """Return a table with a row for each ordered part, with the part found for it and its points."""
    figures: dict[str, Mapping[str, Any]] = {
        each: {"justify": "right"} for each in ("off mm", "turn mrad", "there", "pose")
    }
    columns = {"part": FOLD, "found": FOLD, **figures, "lost": WHOLE}
    return table(columns, map(_part_cells, kit.parts), collapse_padding=True)


def loss_lines(kit: KitEvidence) -> Iterator[str]:
    """A sentence for each kind of loss in this kit."""
    causes = {part.cause for part in kit.parts}
    for cause in REASONS:
        if cause in causes:
            yield f"{cause}: {kit.reason(cause)}"
            if cause == Verdict.MISSING:
                known = Counter(
                    (part.attainable.type, part.fate.sentence()) for part in kit.parts if part.fate is not None
                )
                for (kind, sentence), count in known.items():  # counts of each outcome; indented, below the reason
                    yield f"  {kind}{f' ({count})' if count > 1 else ''}: {sentence}"
            if cause in (NOT_SUBMITTED, ON_ITS_WAY):
                yield from (f"  {sentence}" for sentence in kit.unsent_sentences())
    if kit.score.bonus is not None and kit.score.bonus is not BonusVerdict.EARNED:
        yield f"{kit.score.bonus}: {REASONS[kit.score.bonus]}"
    if summary := kit.attainable.summary():
        yield f"out of reach: {summary}"


def kit_lines(kit: KitEvidence) -> Iterator[str]:
    """Yield the sums of a kit's parts, and its losses."""
    score, each = kit.score, len(kit.parts)
    yield ""
    if score.is_submitted:
        points = (("there", score.part_presence), ("pose", score.part_pose), ("bonus", score.all_parts_bonus))
        yield ", ".join(f"{name} {earned:g} of {each}" for name, earned in points)
    for extra in score.extras:
        yield f"  besides: {extra.name} ({extra.reason})"
    for line in loss_lines(kit):
        indent = line[: len(line) - len(line.lstrip())] + "  "
        yield from wrap(
            line.lstrip(),
            80,
            initial_indent=indent,
            subsequent_indent=indent + "  ",
            break_long_words=False,
            break_on_hyphens=False,
        )


def show_kit(console: Console, order_id: str, kit: KitEvidence) -> None:
    """Print what a kit earned: its name, its table, and why points were lost."""
    title = Text(f"{order_id}, kit {kit.score.kit_type}: ")
    if not kit.score.is_submitted:
        reason = kit.parts[0].cause if kit.parts else NOT_SUBMITTED  # of all parts
        title += Text(f"{reason}, no points", style="bold")
    else:
        title += Text(f"{kit.score.total:g} of {kit.attainable.maximum:g} points", style="bold")
    console.print("\n", title, "\n", sep="", soft_wrap=True)
    print_table(console, kit_table(kit))
    for line in kit_lines(kit):
        console.print(line, markup=False, soft_wrap=True)


def _times(evidence: Evidence) -> Iterator[tuple[str, str]]:
    for order in evidence.orders:
        if order.is_announced:
            end = "" if order.score.is_complete else ", not complete"
            yield "time", f"{order.score.order_id} {seconds(order.score.time_taken):.1f} s{end}"
    carried = f"parts carried for {seconds(evidence.part_travel_time):.1f} s"
    yield "", f"game {seconds(evidence.process_time):.1f} s, {carried}"


def _final(score: TrialScore | None) -> Iterator[str]:
    if score is None:
        return
    terms = [f"cost {score.cost_points:.2f} (factor {score.cost_factor:.2f})"]
    terms += [f"{order.order_id} {order.efficiency_points:.2f} (time {order.efficiency:.2f})" for order in score.orders]
    yield f"{score.total:.2f} = {' + '.join(terms)}"


def _part_cells(part: PartEvidence) -> list[str]:
    kind = part.attainable.type
    fit = None if part.finding is None else part.finding.fit
    lost = "" if part.cause == Verdict.PLACED else part.cause
    points = [f"{part.presence:g}", f"{part.pose:g}"]
    if fit is None:
        return [kind, "-", "", "", *points, lost]
    off, turned = f"{fit.distance * 1e3:.1f}", f"{fit.yaw_difference * 1e3:.0f}"
    return [kind, fit.object_name, off, turned, *points, lost]
