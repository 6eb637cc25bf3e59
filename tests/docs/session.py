"""Follows a page whose commands are typed into terminals."""

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

from tests.docs.pages import INTERRUPT, Command, File, Step, missing
from tests.docs.terminal import Terminal
from tests.support.waiting import TIMEOUT


def follow(taken: Iterable[Step], home: Path, environment: Mapping[str, str], timeout: float = TIMEOUT) -> None:
    """Take the steps of a page in order, and compare what is printed with what it shows.

    Args:
        taken: the steps; programs in Python are for reading here.
        home: the folder that files are named from, where every terminal opens.
        environment: of each terminal, whole.
        timeout: bound for each command [s].

    Raises:
        AssertionError: something else was printed, a command failed, or it took too long.
    """
    terminals: dict[str, Terminal] = {}
    with ExitStack() as opened:
        for step in taken:
            match step:
                case File(name, text):
                    (home / name).write_text(text, encoding="utf-8")
                case Command():
                    if step.terminal not in terminals:
                        terminals[step.terminal] = opened.enter_context(Terminal(home, environment))
                    _take(step, terminals[step.terminal], timeout)


def _take(step: Command, terminal: Terminal, timeout: float) -> None:
    if step.line == INTERRUPT:
        terminal.interrupt()
    elif step.line:
        assert terminal.status is not None, f"{step.line}\nthe command before it still runs:\n{terminal.printed}"
        terminal.give(step.line)

    def is_enough() -> bool:
        return terminal.status is not None or (step.goes_on and missing(step.output, terminal.printed) is None)

    terminal.wait(is_enough, f"end of {step.line!r}, or of what the page shows of it", timeout)
    assert missing(step.output, terminal.printed) is None, f"{step.line}\n{terminal.printed}"
    if step.line and step.line != INTERRUPT and not step.goes_on:
        assert terminal.status == step.status, f"{step.line}\nexit status {terminal.status}:\n{terminal.printed}"
