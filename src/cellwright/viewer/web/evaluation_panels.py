"""Evaluation panels: progress and scores of many runs, and the failures among them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from cellwright.rendering.scene import Scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.web import widgets
from cellwright.viewer.web.page import Feature
from cellwright.viewer.web.widgets import AMBER, BLUE, GREEN, GREY, RED

SHOW = "cellwright/evaluation"
"""Service that selects the run to show, by its `key`; an empty one follows the newest failure."""

KIND = "evaluation"
"""Value of `kind` in a panel; its `of` is an `EvaluationPanel`."""

Range = tuple[float, float]

TRIALS, FAILURES = "Trials", "Failures"  # tabs
NEWEST = "the newest"
"""Option that follows the newest failure."""
_ORDER = -20.0  # above all else


@dataclass(frozen=True, slots=True)
class TrialRow:
    """Runs of one trial.

    Attributes:
        name: name of the trial.
        done: number of runs with a result.
        runs: number of runs in the plan.
        failed: number of runs that crashed, became unstable, were killed or exceeded a limit.
        mean: mean of the points; None without a result.
        interval: its 95 % interval [points]; None if there is none.
        reachable: the most points that an agent can earn.
    """

    name: str
    done: int
    runs: int
    failed: int = 0
    mean: float | None = None
    interval: Range | None = None
    reachable: float = 0.0


@dataclass(frozen=True, slots=True)
class PartLine:
    """Ordered part: what it earned of 2 points, what it could have earned, its type, and why."""

    earned: float
    attainable: float
    type: str
    sentence: str


@dataclass(frozen=True, slots=True)
class KitLines:
    """Kit: its name with points, a line about these, its parts, and lines about objects without use."""

    title: str
    words: str
    parts: Sequence[PartLine] = ()
    extras: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class RunDetail:
    """One run that lost points.

    Attributes:
        name: name of the run.
        outcome: its outcome in a word or two.
        is_done: True if the competition came to its end.
        points: its points, in words.
        reason: reason that it was not done; empty if it was.
        facts: simulated and wall time, in words.
        kits: its points, by kit and part.
        events: its last events, a line each.
        log: its last lines.
        command: command that repeats it; empty if it is not known.
    """

    name: str
    outcome: str
    is_done: bool
    points: str
    reason: str
    facts: str
    kits: Sequence[KitLines] = ()
    events: Sequence[str] = ()
    log: Sequence[str] = ()
    command: str = ""


@dataclass(frozen=True, slots=True)
class EvaluationPanel:
    """State of an evaluation, as a page shows it.

    Attributes:
        agent: name of the agent.
        done: number of runs with a result.
        runs: number of runs in the plan.
        failed: number of runs that crashed, became unstable, were killed or exceeded a limit.
        passed: number of runs that passed.
        judged: number of runs with points to earn, which alone can pass.
        requirement: bound that a run needs to pass, in a few words; empty if it must be done.
        passed_interval: 95 % interval of their share, 0 to 1.
        share: mean share of the attainable points, 0 to 1; None without a result.
        share_interval: its 95 % interval.
        pace: rate and expected end, in words.
        picture: text of the large area.
        trials: a row for each trial.
        failures: keys and unique labels of runs that lost points, the worst first.
        more_failures: number of further ones.
        selected: key of the selected run; empty to follow the newest failure.
        detail: the run that is shown; None if none has lost points.
        notices: faults of the files, a line each.
    """

    agent: str
    done: int
    runs: int
    failed: int = 0
    passed: int = 0
    judged: int = 0
    requirement: str = ""
    passed_interval: Range | None = None
    share: float | None = None
    share_interval: Range | None = None
    pace: str = ""
    picture: str = ""
    trials: Sequence[TrialRow] = ()
    failures: Sequence[tuple[str, str]] = ()
    more_failures: int = 0
    selected: str = ""
    detail: RunDetail | None = None
    notices: Sequence[str] = ()


def head_html(panel: EvaluationPanel) -> str:
    """Progress, overall share and rate of passed runs."""
    left = panel.runs - panel.done
    state = widgets.chip("complete", BLUE) if not left else widgets.chip("in progress", GREEN)
    failed = f'<span style="color:{RED}">{panel.failed} failed</span>' if panel.failed else ""
    parts = [
        *(f'<div style="color:{RED}">{widgets.text(notice)}</div>' for notice in panel.notices),
        widgets.row(f"<b>{_breakable(panel.agent)}</b>", state, "align-items:center"),
        widgets.row(widgets.big(f"{panel.done}", f"of {panel.runs} runs"), failed, "align-items:baseline"),
        widgets.bar(panel.done / panel.runs if panel.runs else 1.0, BLUE),
        widgets.dim(panel.pace),
    ]
    if panel.share is not None and panel.done:
        passed = f"{panel.passed} of {panel.judged}"
        parts.append(_figure("points", f"{panel.share:.1%}", _percent(panel.share_interval)))
        name = "passed" if panel.requirement else "done"
        parts.append(_figure(name, passed, _percent(panel.passed_interval)))
        parts.append(widgets.dim(panel.requirement and f"passed: {panel.requirement}"))
    parts.append(widgets.mark("◉", BLUE, f"view: {_breakable(panel.picture)}"))
    return widgets.block(*parts)


def trials_html(panel: EvaluationPanel) -> str:
    """Row of each trial."""
    return "".join(map(_trial, panel.trials))


def detail_html(panel: EvaluationPanel) -> str:
    """Course of the run that is shown: its outcome, its points, its last words and events."""
    detail = panel.detail
    if detail is None:
        return widgets.block(widgets.dim("no run has lost points"))
    outcome = widgets.chip(detail.outcome, AMBER if detail.is_done else RED)
    parts = [
        widgets.row(f'<b style="font-size:1.05em">{_breakable(detail.name)}</b>', outcome, "align-items:center"),
        widgets.row(widgets.text(detail.points), widgets.figures(detail.facts)),
    ]
    if detail.reason:
        parts.append(f'<div style="color:{RED};overflow-wrap:anywhere">{widgets.text(detail.reason)}</div>')
    words, kits = _section("Last words", detail.log), [part for kit in detail.kits for part in _kit(kit)]
    parts += [*kits, *words] if detail.is_done else [*words, *kits]
    parts += _section("Last events", detail.events)
    parts += _section("Repeat this run", [detail.command])
    return widgets.block(*parts)


def _kit(kit: KitLines) -> Iterator[str]:
    yield f'<div style="margin-top:0.6em"><b>{_breakable(kit.title)}</b></div>'
    yield widgets.dim(kit.words)
    yield from map(_part, kit.parts)
    yield from (widgets.mark("✗", RED, widgets.text(extra)) for extra in kit.extras)


def _section(title: str, lines: Sequence[str]) -> list[str]:
    """Lines under a title; nothing if they say nothing."""
    return [widgets.title(title), widgets.quoted(lines)] if any(map(str.strip, lines)) else []


def _trial(row: TrialRow) -> str:
    failed = f' <span style="color:{RED}">{row.failed} failed</span>' if row.failed else ""
    done = widgets.figures(f"{row.done}/{row.runs}") + failed
    if row.mean is None:
        figures = widgets.dim("no result")
        share = 0.0
    else:
        share = row.mean / row.reachable if row.reachable > 0.0 else 0.0
        range_ = "" if row.interval is None else f"{row.interval[0]:.3g} to {row.interval[1]:.3g}"
        figures = _figure("", f"{row.mean:.4g} of {row.reachable:g}", range_)
        if row.reachable <= 0.0:
            figures = widgets.dim("not judged: no order with points to earn")
    color = (
        GREY if row.mean is None or row.reachable <= 0.0 else GREEN if share >= 0.9 else AMBER if share >= 0.6 else RED
    )
    name = widgets.row(f"<b>{_breakable(row.name)}</b>", done, "align-items:baseline")
    return widgets.block(name, widgets.bar(share, color), figures, style="margin-bottom:0.4em")


def _part(part: PartLine) -> str:
    sign, color = ("✓", GREEN) if part.earned >= part.attainable else ("✓", AMBER) if part.earned else ("✗", RED)
    text = f"<b>{widgets.text(part.type)}</b> +{part.earned:g}{widgets.dim(part.sentence)}"
    return widgets.mark(sign, color, text)


def _figure(name: str, value: str, interval: str) -> str:
    """Row of a figure and its 95 % interval."""
    words = f'<span style="opacity:0.7">95 %: {widgets.text(interval)}</span>' if interval else ""
    return widgets.row(f"{widgets.text(name)} <b>{widgets.figures(value)}</b>", words)


def _percent(interval: Range | None) -> str:
    return "" if interval is None else f"{100 * interval[0]:.3g} to {100 * interval[1]:.3g} %"


def _breakable(name: str) -> str:
    return f'<span style="overflow-wrap:anywhere">{widgets.text(name)}</span>'


class EvaluationPanels(Feature):
    """Panels of an evaluation."""

    def __init__(self) -> None:
        self._keys: dict[str, str] = {NEWEST: ""}
        self._selected = ""
        self._head: Any = None

    def on_scene(self, scene: Scene) -> None:  # noqa: ARG002
        """Create the panels, once."""
        if self._head is not None:
            return
        page, gui = self.page, self.page.server.gui
        self._head = gui.add_html("", order=_ORDER)
        with page.tab(TRIALS):
            self._trials = gui.add_html("")
        with page.tab(FAILURES):
            self._run = gui.add_dropdown("run", (NEWEST,), hint="Runs that lost points, the worst first")
            self._more = gui.add_html("")
            self._detail = gui.add_html("")
        self._run.on_update(self._select)
        self.panel(page.first_panel)

    def panel(self, panel: dict[str, Any]) -> None:
        """Show the state of the evaluation."""
        state = panel.get("of")
        if not isinstance(state, EvaluationPanel):
            return
        keys = {NEWEST: "", **{label: key for key, label in state.failures}}
        self._head.content = head_html(state)
        self._trials.content = trials_html(state)
        if keys != self._keys:
            self._keys = keys
            self._run.options = tuple(keys)
        # Without this check a choice that `_select` has not passed on yet would be undone.
        if state.selected != self._selected:
            self._selected = state.selected
            self._show_selected()
        more = f"and {state.more_failures} more, in report.html at the end" if state.more_failures else ""
        self._more.content = widgets.block(widgets.dim(more)) if more else ""
        self._detail.content = detail_html(state)

    def _select(self, event: Any) -> None:
        if event.client is None:  # the page itself follows the state
            return
        try:
            self.page.link.ask(SHOW, key=self._keys.get(str(event.target.value), ""))
        except CellwrightError as error:
            self.page.notify("run: refused", str(error), is_bad=True)
            self._show_selected()

    def _show_selected(self) -> None:
        label = next((label for label, key in self._keys.items() if key == self._selected), NEWEST)
        if self._run.value != label:
            self._run.value = label  # type: ignore[misc]
