"""Steps that a page of the documentation asks its reader to take.

| in the page | step |
|---|---|
| fenced block under `<!-- file: NAME -->` | a file to write |
| other `python` block | a program to run |
| line `$ cellwright …` in a `console` block | a command; the lines below it are its output, in order |
| block in another language, or under `<!-- not run: REASON -->` | none: it is for reading |

In output, `…` stands for any text, and a line `…` for any lines. `<!-- status: N -->` above a block is the exit status
of its commands, 0 by default.

Under `<!-- terminal: NAME -->`, the commands are typed into a terminal of that name, whatever they are. `^C` presses
Ctrl-C. A command that a later Ctrl-C ends keeps running while other terminals are used. A block that begins with no
command shows the output so far. `<!-- exits: N -->` above that comment is its status.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

_BLOCK = re.compile(
    r"(?:^<!-- not run: (?P<why>[^\n]+) -->\n)?"
    r"(?:^<!-- exits: (?P<exits>\d+) -->\n)?"
    r"(?:^<!-- (?P<key>file|status|terminal): (?P<value>\S+) -->\n)?^```(?P<language>\w*)\n(?P<body>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)

INTERRUPT = "^C"
"""Line that presses Ctrl-C."""


@dataclass(frozen=True)
class File:
    name: str
    text: str


@dataclass(frozen=True)
class Program:
    text: str


@dataclass(frozen=True)
class Command:
    line: str
    output: tuple[str, ...]
    status: int
    terminal: str = ""
    goes_on: bool = False


Step = File | Program | Command


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its content, and the reason if it is not run."""

    language: str
    body: str
    key: str | None
    why: str | None


def blocks(page: Path) -> list[Block]:
    """Return every fenced block of a page."""
    text = page.read_text(encoding="utf-8")
    return [Block(each["language"], each["body"], each["key"], each["why"]) for each in _BLOCK.finditer(text)]


def steps(page: Path) -> list[Step]:
    """Return the steps of a page, in order."""
    return [step for piece in pieces(page.read_text(encoding="utf-8")) if not isinstance(piece, str) for step in piece]


def pieces(text: str) -> list[str | list[Step]]:
    """Split a page at its steps: text for reading, and the steps of each block, in order."""
    found: list[str | list[Step]] = []
    since = 0
    for block in _BLOCK.finditer(text):
        if taken := _steps(block):
            found += [text[since : block.start()], taken]
            since = block.end()
    _mark_running_commands([piece for piece in found if not isinstance(piece, str)])
    return [*found, text[since:]]


def _mark_running_commands(blocks: list[list[Step]]) -> None:
    """Mark each command whose output is read, or which is ended, by the next step in its terminal."""
    following: dict[str, str] = {}
    for block in reversed(blocks):
        for number in reversed(range(len(block))):
            step = block[number]
            if isinstance(step, Command) and step.terminal:
                goes_on = step.line != INTERRUPT and following.get(step.terminal) in ("", INTERRUPT)
                block[number] = replace(step, goes_on=goes_on)
                following[step.terminal] = step.line


def _steps(block: re.Match[str]) -> list[Step]:
    key, value, body = block["key"], block["value"], block["body"]
    if block["why"]:
        return []
    if key == "file":
        return [File(value, body)]
    if block["language"] == "console":
        status = int(value) if key == "status" else int(block["exits"] or 0)
        return [*_commands(body, status, value if key == "terminal" else "")]
    return [Program(body)] if block["language"] == "python" else []


def _commands(body: str, status: int, terminal: str) -> list[Command]:
    later, *parts = re.split(r"^(?:\$ |(?=\^C$))", body, flags=re.MULTILINE)
    found = [Command("", tuple(later.splitlines()), status, terminal)] if later.strip() and terminal else []
    for part in parts:
        line, *output = part.splitlines()
        found.append(Command(line, tuple(output), status, terminal))
    return found


def missing(expected: tuple[str, ...], printed: str) -> str | None:
    """Return the first expected line that was not printed at its place; None if all were.

    Two lines without `…` between them may be separated only by empty lines.
    """
    lines = [line.rstrip() for line in printed.splitlines() if line.strip()]
    at, anywhere = 0, False
    for line in expected:
        if line.strip() == "…":
            anywhere = True
        elif line.strip():
            pattern = re.compile(r".*".join(re.escape(part) for part in re.split(r" *… *", line.rstrip())))
            last = len(lines) if anywhere else min(at + 1, len(lines))
            hit = next((index for index in range(at, last) if pattern.fullmatch(lines[index])), None)
            if hit is None:
                return line
            at, anywhere = hit + 1, False
    return None if anywhere or at == len(lines) or not expected else f"no more lines, but there was {lines[at]!r}"
