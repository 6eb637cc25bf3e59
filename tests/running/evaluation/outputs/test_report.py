"""Tests of the report: whole, in one file, and with everything in its place."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from cellwright.running.evaluation.outputs.report import report
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import Threshold
from tests.running.evaluation.made_results import CRASHED, LOST, result, worked

EMPTY = {"meta", "rect", "path", "line", "img", "wbr"}


class Page(HTMLParser):
    """HTML parser that collects the text and the tags of a page, and whether they are closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if tag not in EMPTY:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


RESULTS = [result(), worked(seed=4), CRASHED, LOST]


@pytest.mark.parametrize(
    "results", [[], [result()], RESULTS, [result(0.0, reachable=0.0)]], ids=["none", "one", "all", "0"]
)
def test_report_is_valid_html_without_external_files(results: list[Result]) -> None:
    text = report(results, Threshold.read("75%"))
    page = Page(text)
    assert page.open == []
    assert not {"script", "link", "img", "iframe", "object"} & {tag for tag, _ in page.tags}
    assert not any({"src", "href", "xlink:href", "srcset"} & set(attributes) for _, attributes in page.tags)
    assert "://" not in text
    assert not re.search(r"@import|url\(", text)


def test_pictures_are_part_of_the_report() -> None:
    page = Page(report(RESULTS, None, pictures={CRASHED.key: b"\x89PNG"}))
    assert page.open == []
    (picture,) = (attributes for tag, attributes in page.tags if tag == "img")
    assert picture["src"] == "data:image/png;base64,iVBORw=="
    assert picture["alt"] == "The cell at the end of the run"


def test_report_shows_worst_runs_first_and_opened() -> None:
    page = Page(report(RESULTS, None))
    assert re.findall(r"tiny seed \d", page.text) == ["tiny seed 3", "tiny seed 2", "tiny seed 4", "tiny seed 1"]
    assert ["open" in attributes for tag, attributes in page.tags if tag == "details"] == [True, True, True, False]


def test_long_key_in_the_name_of_a_trial_may_break_at_its_dots() -> None:
    name = "lesson cellwright.arm.servo=precise"
    text = report([result(trial=name)], None)
    assert "lesson cellwright.<wbr>arm.<wbr>servo=precise" in text
    page = Page(text)
    assert (page.open, name in page.text) == ([], True)


def test_report_contains_scores_reasons_and_evidence() -> None:
    page = Page(report(RESULTS, Threshold.read("75%")))
    for text in (
        "my.py:Mine",
        "1 trial, 4 seeds; required of every run: 75 % of the points",
        "1 of 4",
        "33.3%",
        "2 of 12 points, below the required 75 % of the points",
        "still running after 5 s",
        "ValueError: <no> & \\x07 \\x1b[31m",
        "bin1|gear_part_1",
        "extra: bin2|disk_part_1 (wrong type)",
        "kit order_0_kit_0: 2 of 6 points",
        "present 1 of 2, pose 1 of 2, bonus 0 of 2 (an ordered part is not there)",
        "kit order_0_kit_1: 0 of 4 points attainable, 6 at most",
        "its kit was never submitted",
        "none on the tray <when> submitted",
    ):
        assert text in page.text, text
    assert "2 trials" in Page(report([result(), result(trial="other")], None)).text


def test_report_has_intervals_beside_rates_and_scores() -> None:
    text = Page(report([result(6.0 + seed % 3, seed=seed) for seed in range(12)], Threshold.read("7"))).text
    assert "runs completed (95 %: 75.8 to 100 %)" in text
    for words in ("runs passed (95 %: 39.1 to 86.2 %)", "attainable points (95 %: 53.8 to 62.8 %)", "6.45 to 7.53"):
        assert words in text, words
    assert "95 %:" not in Page(report([result()], None)).text


def test_report_has_time_and_placement() -> None:
    text = Page(report(RESULTS, None)).text
    assert "Time and placement" in text
    assert "tinytime, s20" in text
    assert "tinyoff, mm4.2" in text
    assert "Time and placement" not in Page(report([LOST], None)).text


def test_lost_run_has_no_timeline() -> None:
    assert '<svg class="timeline"' not in report([LOST], None)
    assert report([worked()], None).count('<svg class="timeline"') == 1


def test_tile_of_failed_runs_counts_crashed_and_unstable_ones() -> None:
    crashed = [replace(CRASHED, seed=seed, key=f"tiny-{seed}") for seed in range(1, 16)]
    assert "15failed: crashed, unstable, killed or over a limit" in Page(report(crashed, None)).text
    mixed = [result(), LOST, replace(CRASHED, outcome="unstable"), replace(CRASHED, outcome="gave_up")]
    assert "2failed: crashed" in Page(report(mixed, None)).text
