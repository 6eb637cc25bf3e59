"""The steps that a page of the documentation asks its reader to take.

What counts: a fenced block under `<!-- file: NAME -->` is a file to write; any other `python` block is a program to
run; each line `$ cellwright …` in a `console` block is a command to give, and the lines below it are what it prints, in
that order, where `…` stands for anything and a line `…` for any lines. `<!-- status: N -->` above a block says how its
commands exit, 0 when left out. Blocks of other languages are for reading.
"""

import re
from dataclasses import dataclass
from pathlib import Path

_BLOCK = re.compile(
    r"(?:^<!-- (?P<key>file|status): (?P<value>\S+) -->\n)?^```(?P<language>\w*)\n(?P<body>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


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


Step = File | Program | Command


def steps(page: Path) -> list[Step]:
    """The steps of a page, in order."""
    found: list[Step] = []
    for block in _BLOCK.finditer(page.read_text(encoding="utf-8")):
        key, value, body = block["key"], block["value"], block["body"]
        if key == "file":
            found.append(File(value, body))
        elif block["language"] == "console":
            found += _commands(body, int(value) if key == "status" else 0)
        elif block["language"] == "python":
            found.append(Program(body))
    return found


def _commands(body: str, status: int) -> list[Command]:
    found = []
    for part in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
        line, *output = part.splitlines()
        found.append(Command(line, tuple(output), status))
    return found


def missing(expected: tuple[str, ...], printed: str) -> str | None:
    """The first expected line that was not printed where it should be; None when all were.

    Between two lines with no `…` between them nothing else may stand but empty lines.
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
