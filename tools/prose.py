"""Prose check: given-up words, openings and long sentences in code, scripts and docs.

`python -m tools.prose` prints each finding as `path:line: what is wrong; what to do` and exits with 1 if there are any.
`python -m tools.prose --counts` prints figures instead. The given-up words stand in a table of `docs/glossary.md`.
"""

import argparse
import ast
import io
import re
import statistics
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
GLOSSARY = ROOT / "docs" / "glossary.md"
TABLE = "## Given-up words"

MAX_WORDS, AIM_WORDS = 35, 25
"""Longest sentence that the check accepts, and the longest that it should."""

FOLDERS = ("src", "tools", "benchmarks", "kitting", "fuzz", "tests", "docs", "examples", "adapters")
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")
SCRIPTS = ("Makefile", "Dockerfile", ".ci/run", "scripts/*")
"""Files whose comments begin with `#` and are not Python."""
SKIPPED = (
    "tests/data",
    "src/cellwright/middleware/ros1/packages/data",
    "docs/glossary.md",
    "tests/tools/test_prose.py",
)
"""Text of others, and the files that name the given-up words."""

_QUESTIONS = "what|who|whose|how|where|when|why|whether|which"
OPENINGS = re.compile(rf"(?:\A\s*|^ +\w+: )(?:{_QUESTIONS})\b", re.IGNORECASE | re.MULTILINE)
"""First words of a docstring, or of an entry of its lists such as Args, that are a question."""
_CODE = re.compile(r"`[^`]*`")
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_SENTENCE_END = re.compile(r"(?<=[.!?])[\"')*_]*\s+(?=[A-Z`\"'(\[*_0-9])")
_ENTRY = re.compile(r"\s*(?:[-*+]|\d+\.|\w[\w, *`.]*:)\s")
_BLOCK = re.compile(r"#|\||```|~~~|<!--|[-*] |!!!|\d+\. ")
_CAMEL = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


@dataclass(frozen=True)
class Finding:
    """One place where the prose breaks a rule."""

    path: Path
    line: int
    kind: str
    text: str

    def __str__(self) -> str:
        """The finding as `path:line: text`."""
        return f"{self.path.relative_to(ROOT)}:{self.line}: {self.text}"


@dataclass
class Text:
    """A piece of prose of a file: a docstring, a comment, a string or a paragraph of a page.

    Attributes:
        line: its first line, from 1.
        text: the prose.
        kind: `docstring`, `attribute`, `comment`, `string`, `name`, `script`, `page` or `table`.
    """

    line: int
    text: str
    kind: str


@dataclass
class Report:
    """Findings and figures of a check."""

    findings: list[Finding] = field(default_factory=list)
    sentences: list[int] = field(default_factory=list)
    """Words of each sentence of docstrings and pages."""


def given_up_words(page: str) -> dict[str, str]:
    """Read the table of given-up words: each word in lower case with what replaces it.

    Raises:
        ValueError: the page has no such table.
    """
    _, found, rest = page.partition(TABLE)
    if not found:
        raise ValueError(f"docs/glossary.md: no heading {TABLE!r}; add it with a table below it")
    words: dict[str, str] = {}
    for row in re.findall(r"^\| (.+?) \| (.+?) \|", rest.split("\n## ")[0], re.MULTILINE)[1:]:
        words |= {word.strip().lower(): row[1] for word in row[0].split(",") if set(word.strip()) != {"-"}}
    return words


def python_texts(source: str) -> Iterator[Text]:
    """Yield the prose of a Python file: docstrings, comments, strings of several words, and names."""
    tree = ast.parse(source)
    strings = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for number, inner in enumerate(body if isinstance(body, list) else ()):
            value = inner.value if isinstance(inner, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                strings.add(id(value))
                is_first = number == 0 and isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
                yield Text(value.lineno, value.value, "docstring" if is_first else "attribute")
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield Text(node.lineno, node.name, "name")
        elif isinstance(node, ast.arg):
            yield Text(node.lineno, node.arg, "name")
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield Text(node.lineno, node.id, "name")
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield Text(node.lineno, node.attr, "name")
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in strings:
            yield Text(node.lineno, node.value if " " in node.value.strip() else "", "string")
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and "noqa" not in token.string and "type:" not in token.string:
            yield Text(token.start[0], token.string.lstrip("# "), "comment")


def script_texts(source: str) -> Iterator[Text]:
    """Yield the comments of a script, of neighbouring lines together."""
    lines: list[str] = []
    for number, line in enumerate([*source.splitlines(), ""], start=1):
        is_comment = line.lstrip().startswith("#") and not line.startswith("#!")
        if is_comment:
            text = line.lstrip("# \t")
            lines.append(f"\n{text}" if re.search(r"\S {2,}\S", text) else text)  # a row of a table
        elif lines:
            yield Text(number - len(lines), "\n".join(lines), "script")
            lines = []


def page_texts(source: str) -> Iterator[Text]:
    """Yield the prose of a Markdown page: paragraphs, and rows of tables; no code and no comments."""
    lines: list[str] = []
    fence, comment, start = "", False, 1
    for number, line in enumerate([*source.splitlines(), ""], start=1):
        bare = line.strip()
        if fence or comment:
            fence = "" if fence and bare.startswith(fence) else fence
            comment = comment and "-->" not in bare
            continue
        is_break = (
            not bare
            or bare.startswith(("#", "|", "```", "~~~", "<!--", "- ", "* ", "!!!"))
            or re.match(r"\d+\. ", bare)
        )
        if is_break and lines:
            yield Text(start, "\n".join(lines), "page")
            lines = []
        if bare.startswith(("```", "~~~")):
            fence = bare[:3]
        elif bare.startswith("<!--"):
            comment = "-->" not in bare
        elif bare.startswith("|"):
            yield Text(number, bare, "table")
        elif bare:
            start = start if lines else number
            lines.append(line)


def sentences(text: str) -> Iterator[str]:
    """Yield the sentences of a docstring or paragraph; code counts as one word, an entry of a list as a sentence."""
    paragraph: list[str] = []
    for line in [*_LINK.sub(r"\1", _CODE.sub("code", text)).splitlines(), ""]:
        if (not line.strip() or _ENTRY.match(line) or line.lstrip().startswith((">>>", "..."))) and paragraph:
            yield from _SENTENCE_END.split(" ".join(paragraph))
            paragraph = []
        if line.strip() and not line.lstrip().startswith((">>>", "...", "|")):
            paragraph.append(line.strip())


def check(path: Path, words: dict[str, str], report: Report) -> None:
    """Check one file, and add what is found to the report."""
    source = path.read_text()
    pattern = re.compile(
        r"\b(" + "|".join(map(re.escape, sorted(words, key=len, reverse=True))) + r")\b", re.IGNORECASE
    )
    is_page = path.suffix == ".md"
    read = page_texts if is_page else python_texts if path.suffix == ".py" else script_texts
    for text in read(source):
        prose = " ".join(_CAMEL.findall(text.text)) if text.kind == "name" else text.text
        for offset, line in enumerate(prose.splitlines()):
            for word in pattern.findall(_CODE.sub("", line) if is_page else line):
                instead = f"{word!r} is given up; write {words[word.lower()]}"
                report.findings.append(Finding(path, text.line + offset, "word", instead))
        for found in OPENINGS.finditer(text.text) if text.kind in ("docstring", "attribute") else ():
            number = text.line + text.text.count("\n", 0, found.end())
            opening = "an opening with a question word; begin with a noun or a verb"
            report.findings.append(Finding(path, number, "opening", opening))
        if text.kind in ("docstring", "attribute", "page", "script"):
            for sentence in sentences(text.text):
                count = sum(any(map(str.isalnum, word)) for word in sentence.split())
                report.sentences.append(count)
                if count > MAX_WORDS:
                    long = f"a sentence of {count} words (at most {MAX_WORDS}); split it: {sentence[:50]!r}"
                    report.findings.append(Finding(path, text.line, "sentence", long))


def files(root: Path = ROOT) -> list[Path]:
    """The files whose prose is checked."""
    found = [path for folder in FOLDERS for path in sorted((root / folder).rglob("*")) if path.suffix in (".py", ".md")]
    found += [root / page for page in PAGES if (root / page).exists()]
    found += [path for script in SCRIPTS for path in sorted(root.glob(script)) if path.is_file() and path not in found]
    return [path for path in found if not is_skipped(path, root)]


def is_skipped(path: Path, root: Path = ROOT) -> bool:
    """Return whether the check leaves a file out."""
    return path.is_relative_to(root) and str(path.relative_to(root)).startswith(SKIPPED)


def figures(report: Report) -> list[str]:
    """The counts of a report, a line each."""
    by_kind = Counter(each.kind for each in report.findings)
    lines = {(each.path, each.line) for each in report.findings if each.kind == "word"}
    long = sum(count > AIM_WORDS for count in report.sentences)
    return [
        f"openings with a question word: {by_kind['opening']}",
        f"given-up words: {by_kind['word']}, on {len(lines)} lines",
        f"sentences: {len(report.sentences)}, median {statistics.median(report.sentences or [0]):g} words",
        f"sentences over {AIM_WORDS} words: {long}, over {MAX_WORDS}: {by_kind['sentence']}",
    ]


def main() -> int:
    """Run the check over the project or the given files; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.prose", description="Check the prose of code and docs.")
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH", help="files to check (default: all)")
    parser.add_argument("--counts", action="store_true", help="print figures instead of findings")
    options = parser.parse_args()
    words, report = given_up_words(GLOSSARY.read_text()), Report()
    named = [path.resolve() for path in options.paths]
    for path in [path for path in named if not is_skipped(path)] if named else files():
        check(path, words, report)
    lines = figures(report) if options.counts else list(map(str, report.findings))
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    return int(bool(report.findings) and not options.counts)


if __name__ == "__main__":
    sys.exit(main())
