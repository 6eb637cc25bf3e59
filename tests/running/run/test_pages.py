"""Tests of the lines about a page, and of the browser that it is opened in."""

from __future__ import annotations

import webbrowser
from typing import Any

import pytest

from cellwright.running.run import PageOptions, pages
from cellwright.viewer.web import start


class Page:
    url = "http://127.0.0.1:1"

    def __init__(self, _source: object, **given: Any) -> None:
        self.given = given


@pytest.mark.parametrize("has_desktop", [False, True])
def test_page_is_opened_in_browser_where_there_is_a_desktop(has_desktop: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(start, "WebPage", Page)
    monkeypatch.setattr(pages, "has_desktop", lambda: has_desktop)

    def open_browser(url: str) -> bool:
        opened.append(url)
        return True

    monkeypatch.setattr(webbrowser, "open", open_browser)
    lines: list[str] = []
    page: Any = pages.open_page_of({}, PageOptions(token="x", opens=True), "a", lines.append, another="run.mcap")
    page.given["on_gone"]()
    assert opened == [Page.url] * has_desktop
    assert lines[0] == f"page: {Page.url}"
    assert "open to the network" in lines[1]
    assert ("no desktop found" in lines[2]) == (not has_desktop)
    assert lines[-1] == "the page has stopped; open another one with: cellwright view run.mcap"
