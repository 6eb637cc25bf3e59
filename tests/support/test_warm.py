"""Tests of programs from a warm start: they behave as those that the interpreter starts."""

import os
import signal
import sys
from pathlib import Path

import pytest

from tests.support.processes import Process
from tests.support.warm import WarmStart


@pytest.mark.parametrize(
    ("program", "status", "out", "err"),
    [
        ("import os, sys; print(os.path.basename(os.getcwd()), sys.argv[1:], os.environ['WORD'])", 0, None, ""),
        ("import sys; print('é'); print('no', file=sys.stderr); sys.exit(3)", 3, "é\n", "no\n"),
        ("import atexit; atexit.register(print, 'the end')", 0, "the end\n", ""),
        ("import sys; sys.exit('wrong')", 1, "", "wrong\n"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", -9, "", ""),
        ("import signal; print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)", 0, "True\n", ""),
        ("import sys; print(repr(sys.stdin.read()), __name__, sorted(vars())[-1])", 0, "'' __main__ sys\n", ""),
        ("import here; here.say()", 0, "said\n", ""),
    ],
)
def test_program_exits_with_its_status(
    warm: WarmStart, program: str, status: int, out: str | None, err: str, tmp_path: Path
) -> None:
    (tmp_path / "here.py").write_text("def say() -> None:\n    print('said')\n")
    ran = warm.run(program, "a", "b c", folder=tmp_path, environment={"WORD": "hello"})
    assert (ran.returncode, ran.stderr) == (status, err)
    assert ran.stdout == (f"{tmp_path.name} ['a', 'b c'] hello\n" if out is None else out)


def test_error_is_printed_and_next_program_runs(warm: WarmStart, tmp_path: Path) -> None:
    ran = warm.run("x = 1\n1 / 0", folder=tmp_path)
    assert ran.returncode == 1
    assert 'File "<string>", line 2, in <module>' in ran.stderr
    assert ran.stderr.endswith("ZeroDivisionError: division by zero\n")
    assert warm.run("print('x' in vars())", folder=tmp_path).stdout == "False\n"


def test_running_program_can_be_read_signalled_and_awaited(warm: WarmStart, tmp_path: Path) -> None:
    program = "import sys; print('ready', sys.argv[1:]); sys.stdin.read(); import signal; signal.pause()"
    process = Process([sys.executable, "-c", program, "a"], os.environ, tmp_path, warm=warm)
    process.wait_for(r"^ready \['a'\]$")
    assert process.running
    os.kill(process.pid, 0)
    assert process.interrupt() == -signal.SIGINT or "KeyboardInterrupt" in process.err
    assert not process.running


def test_two_programs_run_concurrently(warm: WarmStart, tmp_path: Path) -> None:
    program = "import signal, sys; print('up'); signal.pause()"
    first, second = (Process([sys.executable, "-c", program], os.environ, tmp_path, warm=warm) for _ in range(2))
    second.wait_for("up")
    first.wait_for("up")
    second.kill()
    assert first.running
    first.kill()
    assert (first.finish(), second.finish()) == (-signal.SIGKILL, -signal.SIGKILL)


def test_module_and_file_run_as_main_module(warm: WarmStart, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "said.py").write_text("WORD = 'hello'\n")
    text = "import sys\nfrom said import WORD\nif __name__ == '__main__':\n    print(WORD, sys.argv[1:])\n"
    (tmp_path / "mine" / "whole.py").write_text(text)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "mine")}
    for command in (["-m", "whole"], [str(tmp_path / "mine" / "whole.py")]):
        process = Process([sys.executable, *command, "x"], environment, tmp_path, warm=warm)
        assert (process.finish(), process.out, process.err) == (0, "hello ['x']\n", "")
