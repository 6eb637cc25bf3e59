"""Page of an evaluation: its content, and the program of its process.

The process reads the folders of the evaluation, so that it can watch one of another machine, and delays none. Its
`source` has `folders`, and `min_score` as on the command line, or an empty text.
"""

import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import viser

from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.scene import encode_scene
from cellwright.running.evaluation.results.follow import FollowedEvaluation, Row, event_lines, log_of, whole_result
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.state import (
    LIVE_NAME,
    STATES,
    State,
    StateError,
    loses_points,
    read_state,
    state_file,
)
from cellwright.running.evaluation.results.summary import (
    Threshold,
    by_trial,
    kit_words,
    mean_share,
    passed_count,
    passed_interval,
    share_interval,
    worst_first,
)
from cellwright.util.errors import CellwrightError, RejectedCommandError, UnknownNameError, UsageError, printable
from cellwright.viewer.services.names import FRAME, PANEL, SCENE
from cellwright.viewer.services.scene import SceneServices
from cellwright.viewer.web import evaluation_panels as panels
from cellwright.viewer.web.page import Feature, Page
from cellwright.viewer.web.program import is_plain, show_page
from cellwright.viewer.web.scene import Bodies, Environment, Shadows
from cellwright.viewer.web.views import Views

PROGRAM = "cellwright.running.evaluation.outputs.page"

MAX_FAILURES = 200
"""Runs in the list to choose from."""
_MAX_LINES = 30  # of a log
_MAX_WORD, _MAX_TEXT = 80, 1000  # characters of names and of sentences
_PERIOD = 0.5  # [s] between two looks at the files
_EFFORT = 5.0  # times as long as its last computation, all figures stay as they are
_NOWHERE = Scene("", ("world",), (), ()), SceneFrame(0, np.array([[0, 0, 0, 1, 0, 0, 0]], np.float32), np.array([True]))


class _LastStates:
    """Source of the scene of one cell, and its state in one run after the other."""

    def __init__(self, scene: Scene, frame: SceneFrame, run: int = 0) -> None:
        self.scene = encode_scene(scene)
        self.current = frame
        self.run = run

    def metadata(self) -> dict[str, Any]:
        return {"kind": "cell"}

    def frame(self) -> SceneFrame:
        return self.current

    def details(self, _request: dict[str, Any]) -> dict[str, Any]:
        return {"tick": 0, "run": self.run}


class EvaluationSource:
    """Evaluation as a page shows it, in place of a server; see `Connection`.

    Args:
        evaluation: the evaluation.
        threshold: score that a run must reach to pass; None: it must be done.
        clock: wall time [s].
    """

    address = ("", 0)

    def __init__(
        self,
        evaluation: FollowedEvaluation,
        threshold: Threshold | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.welcome: dict[str, Any] = {}
        self._evaluation = evaluation
        self._threshold = threshold
        self._clock = clock
        # a browser's click comes in a thread of its own
        self._lock = threading.RLock()
        self._looked = clock() - _PERIOD
        self._selected = ""
        self._rows: Mapping[str, Row] = {}
        self._newest = ""
        self._figures: dict[str, Any] = {}
        self._figures_due = 0.0
        self._has_news = True
        self._trouble = ""
        self._shown: Any = None
        self._picture = ""
        self._detail: tuple[Row, panels.RunDetail] | None = None
        self._scene_file: Path | None = None
        self._states = _LastStates(*_NOWHERE)
        self._services = SceneServices(self._states)

    def sibling(self) -> "EvaluationSource":
        """Return the source itself: all of its answers are quick."""
        return self

    def ask(self, service: str, **request: Any) -> dict[str, Any]:
        """Answer a request for the panel, or select a run."""
        with self._lock:
            if service == PANEL:
                return {"kind": panels.KIND, "of": self.panel()}
            if service == panels.SHOW:
                self._select(str(request["key"]))
                return {}
        raise UnknownNameError("service", service, (PANEL, panels.SHOW))

    def ask_data(self, service: str, **request: Any) -> tuple[dict[str, Any], memoryview]:
        """Answer a request for the scene or a frame of what is shown."""
        with self._lock:
            self._look()
            answer, content = self._services.scene(request) if service == SCENE else self._services.frame(request)
        return answer, memoryview(content)

    def next_frame(
        self, request: dict[str, Any], timeout: float, *, is_first: bool
    ) -> tuple[dict[str, Any], memoryview] | None:
        """Return the present frame, with the panel; the first one at once. See `Connection`."""
        if not is_first:
            time.sleep(timeout)
        answer, data = self.ask_data(FRAME, **request)
        return {**answer, "panel": self.ask(PANEL)}, data

    def end_stream(self) -> None:
        """Do nothing: no frame comes without a call."""

    def publish(self, topic: str, message: Any) -> None:  # noqa: ARG002
        """Refuse a message: there is no bus."""
        raise RejectedCommandError("an evaluation has no topics")

    def call(self, service: str, request: Any) -> Any:  # noqa: ARG002
        """Refuse a call: there is no bus."""
        raise RejectedCommandError("an evaluation has no services")

    def close(self) -> None:
        """Do nothing: no file stays open."""

    def panel(self) -> panels.EvaluationPanel:
        """Return the panel as of now."""
        self._look()
        evaluation, row = self._evaluation, self._rows.get(self._selected or self._newest)
        return panels.EvaluationPanel(
            agent=_word(evaluation.plan["agent"]),
            done=evaluation.done,
            runs=len(evaluation.plan["runs"]),
            pace=self._pace(),
            picture=self._picture or ("no run has lost points" if evaluation.done else "no run has begun yet"),
            selected=self._selected,
            detail=None if row is None else self._detail_of(row),
            notices=[_text(notice) for notice in (*evaluation.notices, self._trouble) if notice],
            **self._figures,
        )

    def _look(self) -> None:
        """Read the files, and compute what follows from them, if it is time."""
        now = self._clock()
        if now - self._looked < _PERIOD:
            return
        self._looked = now
        self._has_news |= self._evaluation.read()
        if self._has_news and now >= self._figures_due:
            begun = time.perf_counter()
            self._has_news, self._trouble = False, ""
            try:
                self._compute()
            except (ArithmeticError, ValueError) as error:  # points of no evaluation
                self._trouble = f"the results give no figures: {error}"
            self._figures_due = now + _EFFORT * (time.perf_counter() - begun)
        self._show()

    def _compute(self) -> None:
        rows = self._rows = self._evaluation.rows
        results = [row.result for row in rows.values()]
        failures = worst_first(filter(loses_points, results))
        self._newest = max((each.key for each in failures), key=lambda key: rows[key].number, default="")
        if self._selected not in rows:
            self._selected = ""
        listed = failures[:MAX_FAILURES]
        self._figures = {
            "failed": sum(each.has_failed for each in results),
            "passed": passed_count(results, self._threshold)[0],
            "judged": passed_count(results, self._threshold)[1],
            "requirement": "" if self._threshold is None else f"done, with at least {self._threshold}",
            "passed_interval": passed_interval(results, self._threshold),
            "share": mean_share(results),
            "share_interval": share_interval(results),
            "trials": self._trials(results),
            "failures": _labels(listed),
            "more_failures": len(failures) - len(listed),
        }

    def _trials(self, results: Sequence[Result]) -> list[panels.TrialRow]:
        groups = by_trial(results)
        found = []
        for trial, runs in self._evaluation.counts.items():
            group = groups.get(trial, ())
            if not group:
                found.append(panels.TrialRow(_word(trial), 0, runs))
                continue
            interval, reachable = share_interval(group), group[0].reachable
            found.append(
                panels.TrialRow(
                    name=_word(trial),
                    done=len(group),
                    runs=runs,
                    failed=sum(each.has_failed for each in group),
                    mean=fmean(each.points for each in group),
                    interval=None if interval is None else (interval[0] * reachable, interval[1] * reachable),
                    reachable=reachable,
                )
            )
        return found

    def _pace(self) -> str:
        evaluation = self._evaluation
        left = len(evaluation.plan["runs"]) - evaluation.done
        if not left:
            return "all runs have a result"
        rate, since = evaluation.rate(), evaluation.since_last()
        if rate is None:
            return f"{left} to go"
        words = f"{rate:.1f} runs a second" if rate >= 1.0 else f"{rate * 60.0:.1f} runs a minute"
        words += f", {_duration(left / rate)} to go"
        return f"{words}; the last {_duration(since)} ago" if since is not None and since > 60.0 else words

    def _select(self, key: str) -> None:
        if key and key not in self._rows:
            raise RejectedCommandError("there is no such run any more")
        self._selected = key
        self._show()

    def _show(self) -> None:
        """Show the last state of a failure, or else that of a run in progress."""
        row = self._rows.get(self._selected or self._newest)
        if row is None:
            self._show_live()
            return
        if self._shown == (row.result.key, row.number):
            return
        self._shown = row.result.key, row.number
        result = row.result
        try:
            state = read_state(state_file(row.folder, result.log_name))
        except StateError as error:
            self._picture = f"{_word(result.name)}: {_text(str(error))}"
            self._set(*_NOWHERE, None)
            return
        self._set(state.scene, state.frame, state.scene_file)
        self._picture = f"{_word(result.name)} at its end, {state.frame.time / 1e9:.1f} s"

    def _show_live(self) -> None:
        newest = max(filter(None, map(_live, self._evaluation.folders)), default=None)
        if newest is None or newest == self._shown:
            return
        try:
            state: State = read_state(newest[1])
        except StateError:
            return  # it is being replaced
        is_same_run = self._shown is not None and self._states.current.time <= state.frame.time
        self._shown = newest
        self._set(state.scene, state.frame, state.scene_file, continues=is_same_run)
        self._picture = f"{_word(state.name)}, {state.frame.time / 1e9:.1f} s"

    def _set(self, scene: Scene, frame: SceneFrame, file: Path | None, *, continues: bool = False) -> None:
        if file != self._scene_file:
            self._scene_file = file
            self._states = _LastStates(scene, frame, self._states.run + 1)
            self._services = SceneServices(self._states)
            return
        self._states.run += not continues
        self._states.current = frame

    def _detail_of(self, row: Row) -> panels.RunDetail:
        if self._detail is None or self._detail[0] != row:
            self._detail = row, _detail(row)
        return self._detail[1]


def _live(folder: Path) -> tuple[int, Path] | None:
    """Return the time and the file of a live state; None without one."""
    file = folder / STATES / LIVE_NAME
    try:
        return file.stat().st_mtime_ns, file
    except OSError:
        return None


def _labels(results: Sequence[Result]) -> list[tuple[str, str]]:
    """Return keys and labels of runs, each label once."""
    found: dict[str, str] = {}
    for result in results:
        label = f"{_word(result.name)}: {result.points:g} of {result.reachable:g}, {result.outcome.replace('_', ' ')}"
        label = _word(label, 2 * _MAX_WORD)
        found[label if label not in found else f"{label} ({result.key[:8]})"] = result.key
    return [(key, label) for label, key in found.items()]


def _detail(row: Row) -> panels.RunDetail:
    result, reason = row.result, row.result.reason
    try:
        result = whole_result(row)
    except (OSError, UsageError) as error:
        reason = f"{reason}; {error}"
    log = result.log or log_of(row, ".log")
    return panels.RunDetail(
        name=_word(result.name),
        outcome=_word(result.outcome.replace("_", " ")),
        is_done=result.is_done,
        points=f"{result.points:g} of {result.reachable:g} points",
        reason=_text(reason),
        facts=f"{result.simulated:.1f} s simulated, took {result.wall:.1f} s",
        kits=[_kit(kit) for order in result.score.get("orders", ()) for kit in order["kits"]],
        events=[_text(line) for line in list(event_lines(log_of(row, ".jsonl")))[-_MAX_LINES:]],
        log=[_text(line) for line in log[-_MAX_LINES:]],
        command=_text(result.command),
    )


def _kit(kit: Mapping[str, Any]) -> panels.KitLines:
    title, _, words = kit_words(kit).partition(": ")
    parts = [
        panels.PartLine(
            part["presence"] + part["pose"],
            part["reachable_presence"] + part["reachable_pose"],
            _word(part["type"]),
            _text(part["sentence"]),
        )
        for part in kit["parts"]
    ]
    extras = [_text(f"{extra['name']}: {extra['reason']}") for extra in kit["extras"]]
    return panels.KitLines(f"{_word(kit['kit_type'])}: {title}", _text(words), parts, extras)


def _duration(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def _word(text: str, longest: int = _MAX_WORD) -> str:
    """Return a name in one printable line."""
    return " ".join(printable(text, longest).split())


def _text(text: str) -> str:
    return printable(text, _MAX_TEXT)


def features() -> list[Feature]:
    """Return the features of a page, in the order of their tabs."""
    return [panels.EvaluationPanels(), Views(), Bodies(), Shadows(), Environment(is_plain=is_plain())]


def main() -> int:
    """Show the page of an evaluation; return the exit status."""
    return show_page(_page)


def _page(server: viser.ViserServer, source: Mapping[str, Any]) -> Page:
    folders, min_score = [Path(folder) for folder in source["folders"]], str(source["min_score"])
    try:
        evaluation = FollowedEvaluation(folders)
    except OSError as error:
        raise CellwrightError(f"{error.filename}: cannot be read: {error.strerror or error}") from None
    return Page(server, EvaluationSource(evaluation, Threshold.read(min_score) if min_score else None), features())


if __name__ == "__main__":
    sys.exit(main())
