"""Tests of the entry point of the command line."""

import errno
import io
import json
import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from cellwright.__main__ import _shortage, main
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT

ROOT = Path(__file__).parents[1]


def test_console_script_calls_main() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"] == {"cellwright": "cellwright.__main__:main"}


def test_module_runs_command_line() -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "cellwright", "--version"], capture_output=True, text=True, timeout=TIMEOUT, check=True
    )
    assert ran.stdout.startswith("cellwright ")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C cannot be sent to one process there")
@pytest.mark.parametrize("modules", ["numpy", "mujoco", "typer"])
def test_ctrl_c_during_import_prints_nothing(modules: str, tmp_path: Path) -> None:
    """A module on the way stops there to be interrupted."""
    # it sleeps for longer than the bound of the wait: only the signal can have ended it in time
    (tmp_path / f"{modules}.py").write_text("print('loading', flush=True)\nimport time\ntime.sleep(100_000)\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}
    process = Process([sys.executable, "-m", "cellwright", "check", "lesson"], environment, tmp_path)
    try:
        process.wait_for("^loading$")
        status = process.interrupt()
    finally:
        process.kill()
    assert (process.out, process.err) == ("loading\n", "")
    assert status == -signal.SIGINT


def test_ctrl_c_handler_is_restored_after_import(monkeypatch: pytest.MonkeyPatch) -> None:
    from cellwright import __main__ as way_in

    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(sys, "argv", ["cellwright", "--version"])
    for handler in (signal.default_int_handler, signal.SIG_IGN):
        signal.signal(signal.SIGINT, handler)
        try:
            assert way_in.main() == 0
            assert signal.getsignal(signal.SIGINT) is handler
        finally:
            signal.signal(signal.SIGINT, before)


def test_ctrl_c_outside_handlers_prints_interrupted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from cellwright import __main__ as way_in
    from cellwright.cli import main as command_line

    def interrupt() -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(command_line, "main", interrupt)
    assert way_in.main() == 130
    assert capsys.readouterr().err == "interrupted\n"


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_character_missing_in_encoding_is_escaped(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from cellwright import __main__ as way_in

    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding=encoding))
    monkeypatch.setattr("cellwright.cli.main.main", lambda: print("a 配 \udcff", flush=True))
    way_in.main()
    assert written.getvalue().rstrip() == b"a \\u914d \\udcff"


@pytest.mark.slow
def test_leftover_threads_of_agent_do_not_block_exit(tmp_path: Path) -> None:
    (tmp_path / "agents.py").write_text(
        "import threading, time\n"
        "class Leaves:\n"
        "    def run(self, client):\n"
        "        client.start_competition()\n"
        "        threading.Thread(target=time.sleep, args=(100_000,), name='mine').start()\n"
    )
    command = ["run", "lesson", "--agent", "agents.py:Leaves", "--no-picture", "--until", "1", "--json"]
    process = Process([sys.executable, "-m", "cellwright", *command], os.environ, tmp_path)
    status = process.finish()
    assert (status, json.loads(process.out)["outcome"]) == (1, "gave_up")
    assert "threads left running, ended with the process: mine\n" in process.err


def test_lack_of_descriptors_is_reported_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def work() -> int:
        raise error

    monkeypatch.setattr("cellwright.cli.main.main", work)
    error: Exception = OSError(errno.EMFILE, "Too many open files")
    assert main() == 1
    assert capsys.readouterr().err == "error: too many open files for this process; raise the limit (ulimit -n)\n"
    error = OSError(errno.ENOENT, "a defect")
    with pytest.raises(OSError, match="a defect"):
        main()


@pytest.mark.parametrize(
    ("error", "word"),
    [
        (OSError(errno.ENFILE, "file table overflow"), "files"),
        (OSError(errno.ENOMEM, "no memory"), "memory"),
        (MemoryError(), "memory"),
        (ImportError("libx.so: failed to map segment from shared object"), "memory"),
        (RuntimeError("engine error: Could not allocate memory"), "memory"),
    ],
)
def test_shortage_is_distinguished_from_other_errors(error: Exception, word: str) -> None:
    assert word in _shortage(error)
    assert _shortage(OSError(errno.ENOENT, "no such file")) == _shortage(ImportError("no module")) == ""
