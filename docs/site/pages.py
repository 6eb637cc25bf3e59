"""Makes a site of these pages.

README, CONTRIBUTING and CHANGELOG join them, links out of the site become text, and blocks that are files get their
names as titles. mkdocs calls the functions by their names. The pages themselves are written to be read where they lie
as well.
"""

import posixpath
import re
from collections.abc import Callable
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]

JOINING = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
"""Pages that lie above the folder of the others, and what they are called beside them."""

_LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"^<!-- file: (\S+) -->\n```(\w+)$", re.MULTILINE)
_PICTURE = re.compile(r'(<img src="|!\[[^\]]*\]\()docs/')


NEW = "Understand"
"""The section of pages that nobody has given a place yet."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Give every page a place: one that the navigation does not name stands at the end of a section."""
    sections = {title: pages for section in config.nav or [] for title, pages in section.items()}
    named = {path for pages in sections.values() for page in pages for path in page.values()}
    there = sorted(path.relative_to(config.docs_dir).as_posix() for path in Path(config.docs_dir).rglob("*.md"))
    sections[NEW] += [path for path in there if path not in named and not path.startswith("examples/")]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Have the pages join that lie elsewhere."""
    for source, name in JOINING.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:  # noqa: ARG001
    """Lead links from where a page lies in the repository to where it stands in the site."""
    name = page.file.src_uri
    source = next((each for each, joined in JOINING.items() if joined == name), f"docs/{name}")
    written = outside_blocks(markdown, lambda text: _PICTURE.sub(r"\1", led(text, source, name, files)))
    return _FILE.sub(r'```\2 title="\1"', written)


def outside_blocks(markdown: str, change: Callable[[str], str]) -> str:
    """A page with everything changed but its fenced blocks."""
    found, since = [], 0
    for block in _BLOCK.finditer(markdown):
        found += [change(markdown[since : block.start()]), block[0]]
        since = block.end()
    return "".join([*found, change(markdown[since:])])


def led(text: str, source: str, name: str, files: Files) -> str:
    """A text with its links led to pages and files of the site; those to other files of the repository are text."""

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
