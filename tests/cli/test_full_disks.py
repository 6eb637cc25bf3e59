"""Tests of results without space: refused before the start if that is known, reported otherwise."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.running.evaluation.programs import PROGRAMS, TRIAL
from tests.support.quick_children import QUICK_WORKERS

RUN = ("run", "lesson", "--agent", "none", "--until", "0.2")

PLAIN = ("--log", "--record")
"""Options that take a file without a time before it."""

full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")


def on_a_full_disk(name: str) -> str:
    """Return a file that opens and accepts no data."""
    Path(name).symlink_to("/dev/full")
    return name


@pytest.mark.slow
@full
@pytest.mark.parametrize(
    ("option", "name", "message"),
    [
        ("--log", "a.jsonl", "warning: a.jsonl: cannot be written any more: No space left on device"),
        ("--record", "a.mcap", "warning: a.mcap: cannot be written any more: No space left on device"),
        ("--snapshot", "a.png", "warning: cannot write the picture a.png: No space left on device"),
        ("--checkpoint", "a.npz", "checkpoint a.npz: cannot be written: No space left on device"),
    ],
)
@pytest.mark.usefixtures("small_pictures")
def test_file_on_full_disk_is_reported(option: str, name: str, message: str, cellwright: CommandLine) -> None:
    file = on_a_full_disk(name)
    ran = cellwright(*RUN, "--no-picture", "--json", option, file if option in PLAIN else f"0.1:{file}")
    assert ran.status == 1
    assert ran.err.count(message) == 1
    document = json.loads(ran.out)  # the result is whole
    assert document["exit_status"] == 1
    assert document["simulated"] == pytest.approx(0.2)


@full
@pytest.mark.usefixtures("small_pictures")
def test_robot_picture_on_full_disk_is_reported(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "tandem", "--port", "0", "--until", "0.1", "--snapshot", on_a_full_disk("a.png"))
    assert (ran.status, ran.err) == (1, "error: cannot write the picture a.png: No space left on device\n")


@pytest.mark.parametrize(
    ("option", "file"),
    [("--log", "x.jsonl"), ("--record", "x.bag"), ("--snapshot", "x.png"), ("--checkpoint", "x.npz")],
)
@pytest.mark.parametrize("folder", ["none", "a" * 300, "file"])
def test_file_below_a_file_is_refused(folder: str, option: str, file: str, cellwright: CommandLine) -> None:
    Path("file").write_text("")
    place = f"{folder}/{file}"
    ran = cellwright(*RUN, "--no-picture", option, place if option in PLAIN else f"0.1:{place}")
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith(f"error: {option} ")
    assert len(ran.err.splitlines()) == 1


def test_too_long_file_name_is_refused(cellwright: CommandLine) -> None:
    ran = cellwright(*RUN, "--log", "a" * 300 + ".jsonl")
    assert (ran.status, ran.out) == (2, "")
    assert len(ran.err.splitlines()) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="no such rights there")
def test_read_only_folder_is_refused(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellwright.cli.options.os.access", lambda _path, _mode: False)  # root may write everywhere
    ran = cellwright(*RUN, "--log", "a.jsonl")
    assert (ran.status, ran.err) == (2, "error: --log a.jsonl: a.jsonl cannot be written\n")


@QUICK_WORKERS
@pytest.mark.slow
def test_eval_with_unwritable_reports_still_prints_results(cellwright: CommandLine) -> None:
    Path("tiny.yaml").write_text(TRIAL)
    Path("programs.py").write_text(PROGRAMS)
    for name in ("junit.xml", "report.html"):
        Path("evaluation", name).mkdir(parents=True)
    ran = cellwright("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--json", "--jobs", "1")
    assert ran.status == 75
    assert [line for line in ran.err.splitlines() if line.startswith("error: ")] == [
        f"error: {Path('evaluation', name)}: cannot be written: Is a directory" for name in ("junit.xml", "report.html")
    ]
    assert json.loads(ran.out)["results"][0]["points"] == 6.0
    assert json.loads(Path("evaluation/summary.json").read_text())["exit_status"] == 75


def test_unreadable_agent_file_is_reported(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("tiny.yaml").write_text(TRIAL)
    Path("programs.py").write_text(PROGRAMS)

    def refuse(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("cellwright.running.evaluation.plan.job.Path.read_bytes", refuse)
    ran = cellwright("eval", "tiny.yaml", "--agent", "programs.py:Deliver")
    assert ran.status == 2
    assert ran.err.endswith("cannot be read: Permission denied\n")
