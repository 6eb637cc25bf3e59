"""The terminal that pages are followed in behaves like one."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.docs.pages import Command, File, Step
from tests.docs.session import follow
from tests.docs.terminal import Terminal

pytestmark = pytest.mark.skipif(os.name != "posix" or not Path("/usr/bin/setsid").exists(), reason="needs setsid")


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    with Terminal(tmp_path, {"PATH": os.environ["PATH"], "LANG": "C.UTF-8"}) as opened:
        yield opened


def ran(terminal: Terminal, command: str) -> tuple[str, int | None]:
    terminal.give(command)
    terminal.wait(lambda: terminal.status is not None, "end of the command")
    return terminal.printed, terminal.status


def test_terminal_keeps_folder_and_variables(terminal: Terminal, tmp_path: Path) -> None:
    assert ran(terminal, "cd /; word=there") == ("", 0)
    assert ran(terminal, "pwd; echo $word") == ("/\nthere\n", 0)
    assert ran(terminal, "echo gone >&2; false") == ("gone\n", 1)


def test_command_of_many_lines_prints_without_colours(terminal: Terminal) -> None:
    assert ran(terminal, "printf '%s,' \\\na 'b\nc'") == ("a,b\nc,", 0)
    assert ran(terminal, r"printf '\033[31mred\033[0m\033]2;title\007 …\n'") == ("red …\n", 0)


def test_ctrl_c_ends_running_program(terminal: Terminal) -> None:
    terminal.give("trap 'echo caught' INT; sleep 60")
    terminal.wait(lambda: terminal.foreground == "sleep", "program in the foreground")
    assert terminal.status is None
    terminal.interrupt()
    terminal.wait(lambda: terminal.status is not None, "end of the command")
    assert terminal.status == 130


def test_close_of_terminal_ends_running_program(tmp_path: Path) -> None:
    with Terminal(tmp_path, {"PATH": os.environ["PATH"]}) as terminal:
        terminal.give("echo $$; exec sleep 60")
        terminal.wait(lambda: terminal.printed.endswith("\n"), "number of the process")
        pid = int(terminal.printed)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def shown(line: str, *output: str, terminal: str = "one", status: int = 0, goes_on: bool = False) -> Command:
    return Command(line, output, status, terminal, goes_on)


def followed(folder: Path, *taken: Step) -> None:
    follow(taken, folder, {"PATH": os.environ["PATH"], "HOME": str(folder)})


def test_page_is_followed_in_its_named_terminals(tmp_path: Path) -> None:
    followed(
        tmp_path,
        File("wait.sh", "echo waiting\nuntil test -e sign; do sleep 0.05; done\necho seen\nexec sleep 60\n"),
        shown("cd /"),
        shown("sh ~/wait.sh", "waiting", "…", terminal="two", goes_on=True),
        shown("pwd; touch ~/sign", "/"),
        shown("", "…", "seen", terminal="two", goes_on=True),
        shown("^C", terminal="two"),
        shown("echo $?", "130", terminal="two"),
        shown("(exit 3)", status=3),
    )


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        (shown("echo one", "two"), "one"),
        (shown("echo one; false", "one"), "exit status 1"),
        (shown("echo one", "one", status=2), "exit status 0"),
    ],
)
def test_output_or_status_other_than_page_fails(command: Command, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match=complaint):
        followed(tmp_path, command)


def test_command_over_time_limit_fails(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match=r"no end of \'sleep 60\'.* within 0\.3 s"):
        follow([shown("sleep 60")], tmp_path, {"PATH": os.environ["PATH"]}, 0.3)
