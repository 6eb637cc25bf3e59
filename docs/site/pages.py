"""Hook of mkdocs: adapts the pages of the repository for the site.

It adds README, CONTRIBUTING and CHANGELOG, turns links out of the site into text, and shows file names above blocks.
mkdocs finds the functions by their names. The pages can be read in the repository as well.
"""

import posixpath
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]

JOINING = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
"""Pages outside `docs/`, and their names in the site."""

_LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"^<!-- file: (\S+) -->\n```(\w+)$", re.MULTILINE)
_PICTURE = re.compile(r'(<img src="|!\[[^\]]*\]\()docs/')


NEW = "Explanation"
"""Section of the pages that the navigation does not name."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add each page that the navigation does not name to the end of a section."""
    nav = config.nav or []
    named = set(nav_paths(nav))
    pages = sorted(path.relative_to(config.docs_dir).as_posix() for path in Path(config.docs_dir).rglob("*.md"))
    section = next(entry[NEW] for entry in nav if NEW in entry)
    section += [path for path in pages if path not in named and not path.startswith("examples/")]
    return config


def nav_paths(entries: Any) -> Iterator[str]:
    """Paths of all pages below an entry of the navigation: a path, a list, or titles with entries."""
    if isinstance(entries, str):
        yield entries
    else:
        for entry in entries.values() if isinstance(entries, dict) else entries:
            yield from nav_paths(entry)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that lie outside `docs/`."""
    for source, name in JOINING.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:  # noqa: ARG001
    """Rewrite links from places in the repository to places in the site."""
    name = page.file.src_uri
    source = next((each for each, joined in JOINING.items() if joined == name), f"docs/{name}")
    written = outside_blocks(markdown, lambda text: _PICTURE.sub(r"\1", led(text, source, name, files)))
    return _FILE.sub(r'```\2 title="\1"', written)


def outside_blocks(markdown: str, change: Callable[[str], str]) -> str:
    """A page with everything changed except its fenced blocks."""
    found, since = [], 0
    for block in _BLOCK.finditer(markdown):
        found += [change(markdown[since : block.start()]), block[0]]
        since = block.end()
    return "".join([*found, change(markdown[since:])])


def led(text: str, source: str, name: str, files: Files) -> str:
    """A text with links to pages and files of the site; links to other files of the repository become text."""

    def lead(link: re.Match[str]) -> str:
        label, target = link[1], link[2]
        if "://" in target or target.startswith("#"):
            return link[0]
        path, _, anchor = target.partition("#")
        there = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        if not (ROOT / there).exists():
            return link[0]  # mkdocs refuses it
        page = JOINING.get(there, there.removeprefix("docs/") if there.startswith("docs/") else "")
        if files.get_file_from_path(page) is None:
            return label
        return f"[{label}]({posixpath.relpath(page, posixpath.dirname(name) or '.')}{'#' if anchor else ''}{anchor})"

    return _LINK.sub(lead, text)
