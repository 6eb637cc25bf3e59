"""The command of the benchmarks, run in this process."""

from pathlib import Path

import pytest

from benchmarks import __main__ as command
from cellwright.cli.main import main
from tests.cli.conftest import CommandLine, Ran


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: str) -> Ran:
        capsys.readouterr()
        status = main(arguments, command.app, name="python -m benchmarks")
        out, err = capsys.readouterr()
        return Ran(status, out, err)

    return run
