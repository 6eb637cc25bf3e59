"""Conversion of a page whose commands are typed into terminals to a notebook.

A cell of shell commands does not keep the state of the cell before. So each cell first restores the folder and the
sourced files of its terminal. A program that keeps running writes into a file named after its terminal.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.docs.pages import INTERRUPT, Command, File, Step, pieces
from tests.docs.terminal import plain

LIMIT = 60
"""Time [s] that a cell waits for the first output of a program that keeps running."""

_PREPARE = """\
# For all the cells below: plain text, and the command `cellwright` of this Python's environment.
import os
import shutil
import sys

for name in ("FORCE_COLOR", "CLICOLOR_FORCE"):
    os.environ.pop(name, None)
if shutil.which("cellwright") is None:
    os.environ["PATH"] = os.path.dirname(sys.executable) + os.pathsep + os.environ["PATH"]"""

_REMEMBERED = re.compile("cd |source |export |eval ")  # commands that change the shell itself


@dataclass(frozen=True)
class Cell:
    """One cell.

    Attributes:
        source: its content.
        is_code: True if it is run.
        shown: its output as the page shows it; empty if the page shows none.
    """

    source: str
    is_code: bool = False
    shown: tuple[str, ...] = ()


@dataclass
class _Shell:
    """State of a terminal that its cells restore."""

    name: str
    read: list[str] = field(default_factory=list)
    folder: str = ""

    @property
    def log(self) -> str:
        return f"~/terminal-{self.name}"

    def preparation(self) -> list[str]:
        return ["%%bash", *self.read, *([f"cd {self.folder}"] if self.folder else []), "set -e"]

    def remember(self, line: str) -> None:
        if line.startswith("cd "):
            self.folder = line.removeprefix("cd ")
        elif line not in self.read:
            self.read.append(line)


def cells(page: str) -> list[Cell]:
    """The cells of a page.

    Args:
        page: its text. Files are named from the home folder.
    """
    shells: dict[str, _Shell] = {}
    found = []
    for piece in pieces(page):
        if isinstance(piece, str):
            found += [Cell(text)] if (text := piece.strip()) else []
        else:
            found += _cells(piece, shells)
    return [found[0], Cell(_PREPARE, is_code=True), *found[1:]]


def document(made: list[Cell], outputs: dict[int, list[Any]] | None = None) -> dict[str, Any]:
    """The notebook as JSON, in nbformat 4.5.

    Args:
        made: its cells.
        outputs: printed output by number of cell.
    """
    return {
        "cells": [_as_json(number, cell, (outputs or {}).get(number, [])) for number, cell in enumerate(made)],
        "metadata": {
            "kernelspec": {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"},
            "language_info": {"file_extension": ".py", "mimetype": "text/x-python", "name": "python"},
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def as_text(notebook: dict[str, Any]) -> str:
    """A notebook as the text of a file."""
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


def printed(outputs: list[dict[str, Any]]) -> str:
    """Return the text of the outputs of a cell."""
    return plain("".join("".join(output.get("text", "")) for output in outputs))


def as_output(text: str, names: Mapping[str, str]) -> list[dict[str, Any]]:
    """Text as the output of a cell.

    Args:
        text: the text.
        names: folders of this machine and their replacements, in this order.
    """
    for name, better in names.items():
        text = text.replace(name, better)
    return [{"name": "stdout", "output_type": "stream", "text": text.splitlines(keepends=True)}]


def _as_json(number: int, cell: Cell, outputs: list[Any]) -> dict[str, Any]:
    common = {"id": f"step-{number}", "metadata": {}, "source": cell.source.splitlines(keepends=True)}
    if not cell.is_code:
        return {"cell_type": "markdown", **common}
    return {"cell_type": "code", "execution_count": None, **common, "outputs": outputs}


def _cells(block: list[Step], shells: dict[str, _Shell]) -> list[Cell]:
    """The cells of one block of a page; commands that come to an end share one."""
    found = [_file(step) for step in block if isinstance(step, File)]
    waiting: list[Command] = []
    for step in block:
        if isinstance(step, Command):
            shell = shells.setdefault(step.terminal, _Shell(step.terminal))
            if _shares(step):
                waiting.append(step)
            else:
                found += [*_run(shell, waiting), *_alone(shell, step)]
                waiting = []
    return [*found, *(_run(shells[waiting[0].terminal], waiting) if waiting else [])]


def _shares(command: Command) -> bool:
    """Return whether a command may share a cell with others."""
    return not command.goes_on and command.line not in ("", INTERRUPT) and _REMEMBERED.match(command.line) is None


def _alone(shell: _Shell, command: Command) -> list[Cell]:
    """The cells of a command that shares none."""
    if command.line == INTERRUPT:
        return [_interrupt(shell, command)]
    if not command.line:
        return [Cell("\n".join(["%%bash", *_look(shell, command)]), is_code=True, shown=command.output)]
    if command.goes_on:
        return [_start(shell, command)]
    shell.remember(command.line)
    return []


def _file(file: File) -> Cell:
    return Cell(f"%%writefile ~/{file.name}\n{file.text.rstrip()}", is_code=True)


def _run(shell: _Shell, commands: list[Command]) -> list[Cell]:
    if not commands:
        return []
    lines = [*shell.preparation(), *(each.line for each in commands)]
    shown = [line for each in commands for line in (each.output or ("…",))]
    return [Cell("\n".join(lines), is_code=True, shown=tuple(shown))]


def _start(shell: _Shell, command: Command) -> Cell:
    lines = [
        *shell.preparation(),
        "set -m  # so that Ctrl-C, a signal, reaches it",
        f": > {shell.log}.log  # nothing of an earlier run",
        f"{command.line} &> {shell.log}.log &",
        f"echo $! > {shell.log}.pid",
        *_look(shell, command),
    ]
    return Cell("\n".join(lines), is_code=True, shown=command.output)


def _look(shell: _Shell, command: Command) -> list[str]:
    """Lines that show what goes on in a terminal, once the last line that the page shows is printed."""
    sign = max(re.split("…", [line for line in command.output if line != "…"][-1]), key=len).strip()
    wait = f"until grep -q {shlex.quote(sign)} {shell.log}.log; do sleep 0.2; done"
    return [f"timeout {LIMIT} sh -c {shlex.quote(wait)}", f"cat {shell.log}.log"]


def _interrupt(shell: _Shell, command: Command) -> Cell:
    lines = [
        "%%bash",
        f"pid=$(cat {shell.log}.pid)",
        "kill -INT -- -$pid  # as Ctrl-C does",
        f"timeout {LIMIT} tail --pid=$pid -f /dev/null",
        f"cat {shell.log}.log",
    ]
    return Cell("\n".join(lines), is_code=True, shown=command.output)
