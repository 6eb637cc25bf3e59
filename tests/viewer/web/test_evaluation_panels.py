"""Evaluation panels: their content, and the selection of a run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.viewer.web.evaluation_panels import (
    FAILURES,
    KIND,
    NEWEST,
    TRIALS,
    EvaluationPanel,
    EvaluationPanels,
    KitLines,
    PartLine,
    RunDetail,
    TrialRow,
    detail_html,
    head_html,
    trials_html,
)
from tests.viewer.web.pages import clicked, page

DETAIL = RunDetail(
    "tiny seed 2",
    "crashed",
    False,
    "2 of 12 points",
    "ValueError: <no>",
    "3 s",
    [KitLines("kit: 2 of 6 points", "present 1 of 2", [PartLine(0.0, 2.0, "gear", "not there")], ["disk: wrong type"])],
    ["1.00 s  order"],
    ["Traceback", "<script>alert(1)</script>"],
    "cellwright run tiny --seed 2",
)
PANEL = EvaluationPanel(
    agent="my.py:Mine",
    done=3,
    runs=12,
    failed=1,
    passed=2,
    judged=3,
    passed_interval=(0.2, 0.9),
    share=0.625,
    share_interval=(0.25, 0.75),
    pace="2 runs a minute, 5 min to go",
    picture="tiny seed 2 at its end, 3.0 s",
    trials=[TrialRow("tiny", 3, 6, 1, 3.0, (1.0, 5.5), 12.0), TrialRow("other", 0, 6)],
    failures=[("b", "tiny seed 2: crashed"), ("c", "tiny seed 3: done")],
    detail=DETAIL,
)


class Parsed(HTMLParser):
    """HTML parser that collects text and tags."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.text, self.tags, self.open = "", set[str](), list[str]()
        self.attributes = set[str]()
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_head_has_progress_and_intervals() -> None:
    text = Parsed(head_html(PANEL)).text
    for words in (
        "my.py:Mine",
        "in progress",
        "3",
        "of 12 runs",
        "1 failed",
        "62.5%",
        "25 to 75 %",
        "2 of 3",
        "20 to 90 %",
    ):
        assert words in text
    assert "complete" in Parsed(head_html(replace(PANEL, done=12))).text
    assert "done 2 of 3" in Parsed(head_html(PANEL)).text
    passed = Parsed(head_html(replace(PANEL, requirement="at least 8 points"))).text
    assert "passed 2 of 3" in passed
    assert "passed: at least 8 points" in passed
    assert "points" not in Parsed(head_html(EvaluationPanel("a", 0, 5))).text


def test_each_trial_has_a_row() -> None:
    text = Parsed(trials_html(PANEL)).text
    for words in ("tiny3/6 1 failed", "3 of 12", "95 %: 1 to 5.5", "other0/6", "no result"):
        assert words in text


def test_words_of_a_lost_run_come_before_its_points_and_of_a_done_one_behind() -> None:
    text = Parsed(detail_html(PANEL)).text
    assert text.index("ValueError: <no>") < text.index("Last words") < text.index("kit: 2 of 6") < text.index("Repeat")
    assert "<script>alert(1)</script>" in text
    done = Parsed(detail_html(replace(PANEL, detail=replace(DETAIL, is_done=True, events=[""], command="")))).text
    assert done.index("kit: 2 of 6") < done.index("Last words")
    assert "Last events" not in done
    assert "Repeat" not in done
    assert "no run has lost points" in Parsed(detail_html(replace(PANEL, detail=None))).text


HOSTILE = st.text(max_size=30) | st.sampled_from(
    ["<img src=x onerror=alert(1)>", '"><script>', "</pre><b>", "&lt;", "**x**"]
)


@given(HOSTILE)
def test_texts_of_files_are_escaped(text: str) -> None:
    kit = KitLines(text, text, [PartLine(1.0, 2.0, text, text)], [text])
    detail = RunDetail(text, text, False, text, text, text, [kit], [text], [text, text], text)
    panel = replace(
        PANEL,
        agent=text,
        pace=text,
        picture=text,
        requirement=text,
        notices=[text],
        detail=detail,
        trials=[TrialRow(text, 1, 1)],
    )
    for make in (head_html, trials_html, detail_html):
        parsed, plain = Parsed(make(panel)), Parsed(make(PANEL))
        assert parsed.tags <= plain.tags | {"div", "span", "b", "pre"}
        assert parsed.attributes <= {"style"}


@pytest.fixture(scope="module")
def opened() -> Iterator[tuple[Any, EvaluationPanels]]:
    with page({"kind": KIND, "of": PANEL}) as found:
        panels = EvaluationPanels()
        panels.page = found
        panels.on_scene(None)  # type: ignore[arg-type]
        panels.on_scene(None)  # type: ignore[arg-type]
        yield found, panels


def show(panels: EvaluationPanels, **changes: Any) -> None:
    panels.panel({"kind": KIND, "of": replace(PANEL, **changes)})


def test_panels_are_made_once_and_filled(opened: tuple[Any, EvaluationPanels]) -> None:
    found, panels = opened
    assert found.tabs == [TRIALS, FAILURES]
    assert "of 12 runs" in panels._head.content
    assert panels._run.options == (NEWEST, "tiny seed 2: crashed", "tiny seed 3: done")
    assert panels._run.value == NEWEST


def test_choice_of_a_browser_selects_the_run(opened: tuple[Any, EvaluationPanels]) -> None:
    found, panels = opened
    found.link.requests.clear()
    clicked(panels._run, "tiny seed 3: done")
    clicked(panels._run, "tiny seed 2: crashed", by_browser=False)
    clicked(panels._run, NEWEST)
    assert found.link.requests == [{"key": "c"}, {"key": ""}]
    found.link.refuses = "there is no such run any more"
    clicked(panels._run, "tiny seed 3: done")
    found.link.refuses = ""
    assert found.notices == [("run: refused", "there is no such run any more")]
    assert panels._run.value == NEWEST


def test_choice_is_not_undone_before_it_is_passed_on(opened: tuple[Any, EvaluationPanels]) -> None:
    found, panels = opened
    panels._run.value = "tiny seed 3: done"  # type: ignore[misc]  # as viser does before it calls back
    show(panels, selected="")
    assert panels._run.value == "tiny seed 3: done"
    clicked(panels._run, str(panels._run.value))
    assert found.link.requests[-1] == {"key": "c"}
    show(panels, selected="c")
    show(panels, selected="")
    assert panels._run.value == NEWEST


def test_list_follows_the_failures_and_keeps_the_selection(opened: tuple[Any, EvaluationPanels]) -> None:
    _, panels = opened
    show(panels, selected="c")
    assert panels._run.value == "tiny seed 3: done"
    show(panels, selected="c", failures=[("a", "new"), ("c", "tiny seed 3: done")], more_failures=7)
    assert (panels._run.value, panels._run.options) == ("tiny seed 3: done", (NEWEST, "new", "tiny seed 3: done"))
    assert "and 7 more" in panels._more.content
    show(panels, selected="", failures=[])
    assert (panels._run.value, panels._run.options, panels._more.content) == (NEWEST, (NEWEST,), "")


@pytest.mark.parametrize("panel", [{}, {"kind": "cell"}, {"of": {"agent": "x"}}, {"of": None}])
def test_panel_of_something_else_changes_nothing(opened: tuple[Any, EvaluationPanels], panel: dict[str, Any]) -> None:
    _, panels = opened
    before = panels._head.content
    panels.panel(panel)
    assert panels._head.content == before
