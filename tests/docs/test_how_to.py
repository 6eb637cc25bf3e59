"""The short pages: each can be followed, and is short."""

import tomllib
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.docs.pages import File, Program, steps
from tests.docs.test_tutorials import take
from tests.support.quick_children import QUICK_AGENTS, QUICK_WORKERS
from tests.support.warm import WarmStart
from tests.support.workshop import describe

PAGES = sorted((Path(__file__).parents[2] / "docs" / "how-to").glob("*.md"))
LONGEST = 60


@QUICK_AGENTS
@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_how_to_page_followed_prints_what_it_shows(
    page: Path, tmp_path: Path, warm: WarmStart, cellwright: CommandLine
) -> None:
    taken = steps(page)
    for file in taken:
        if isinstance(file, File) and file.name == "pyproject.toml":  # as `pip install -e .` would, from a folder
            project = tomllib.loads(file.text)["project"]
            describe(tmp_path, project["name"], project["entry-points"])
    assert any(not isinstance(step, File | Program) for step in taken)
    take(taken, tmp_path, warm, cellwright)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_how_to_page_stays_below_line_limit(page: Path) -> None:
    assert len(page.read_text(encoding="utf-8").splitlines()) < LONGEST
