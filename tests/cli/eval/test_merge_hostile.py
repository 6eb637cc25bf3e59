"""Shards whose files were changed by hand: `cellwright eval merge` believes no such result, and follows no link."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path

import pytest

from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.seal import sealed
from tests.cli.conftest import CommandLine
from tests.cli.eval.test_merge import jobs_of, shard


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such links and devices")
@pytest.mark.parametrize("name", ["plan.json", "results.jsonl"])
def test_file_that_is_not_regular_is_refused(tiny: CommandLine, name: str) -> None:
    shard(tiny, "a")
    Path("a", name).unlink()
    Path("a", name).symlink_to("/dev/zero")
    ran = tiny("eval", "merge", "a")
    assert (ran.status, ran.err) == (2, f"error: a/{name}: it is a link, not a regular file; use another folder\n")


def edit(folder: str, **changes: object) -> Result:
    """Change the first result of a folder as a program does that knows the seal, and return the one before."""
    file = Path(folder, "results.jsonl")
    line, *rest = file.read_bytes().splitlines(keepends=True)
    first = Result.from_line(line[:-1])
    file.write_bytes(b"".join([sealed(json.dumps({**first.as_json(), **changes})), b"\n", *rest]))
    return first


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": 999.0}, "points must be at most the attainable {0.reachable:g} (got 999)"),
        ({"points": -1.0}, "points must not be negative (got -1)"),
        ({"outcome": "won"}, "unknown outcome 'won'"),
        ({"wall": -1.0}, "wall must not be negative (got -1)"),
    ],
)
def test_result_that_no_run_can_have_is_not_merged(tiny: CommandLine, changes: dict[str, object], message: str) -> None:
    shard(tiny, "a")
    before = edit("a", **changes)
    ran = tiny("eval", "merge", "a")
    assert ran.status == 75
    assert f"{message.format(before)}; this line is not believed" in ran.out.replace("\n", " ")
    assert before.key not in Path("evaluation", "results.jsonl").read_text()


@pytest.mark.parametrize("changes", [{"trial": "easy"}, {"seed": 77}, {"agent": "other.py:Other"}])
def test_shard_with_a_result_of_another_run_is_refused(tiny: CommandLine, changes: dict[str, object]) -> None:
    shard(tiny, "a")
    before = edit("a", **changes)
    ran = tiny("eval", "merge", "a")
    assert ran.status == 2
    assert f"the plan's run of this key is {before.name} of programs.py:Deliver; repeat that shard" in ran.err
    assert not Path("evaluation", "summary.json").exists()


@pytest.mark.parametrize("place", ["results.jsonl", "plan.json", "log", "logs", "state"])
def test_links_in_a_shard_are_refused_and_no_foreign_content_is_merged(tiny: CommandLine, place: str) -> None:
    shard(tiny, "a")
    Path("foreign").mkdir()
    secret = Path("foreign", "secret")
    log = jobs_of(2)[0].log_name
    shutil.rmtree("a/logs", ignore_errors=True)
    match place:
        case "results.jsonl" | "plan.json":
            Path("a", place).rename(secret)
            Path("a", place).symlink_to(secret.resolve())
        case "log":
            secret.write_text("secret")
            Path("a", "logs").mkdir()
            Path("a", "logs", log).symlink_to(secret.resolve())
        case "logs":
            Path("foreign", log).write_text("secret")
            Path("a", "logs").symlink_to(Path("foreign").resolve())
        case _:
            secret.write_text("secret")
            Path("a", "states").mkdir(exist_ok=True)
            Path("a", "states", log).with_suffix(".state").symlink_to(secret.resolve())
    ran = tiny("eval", "merge", "a")
    assert ran.status == 2
    assert "it is a link, not a regular file" in ran.err
    assert not any("secret" in each.read_text() for each in Path("evaluation").rglob("*.log"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes there")
@pytest.mark.parametrize("name", ["results.jsonl", "plan.json", "log"])
def test_named_pipe_in_a_shard_is_refused_without_waiting(tiny: CommandLine, name: str) -> None:
    shard(tiny, "a")
    pipe = Path("a", "logs", jobs_of(2)[0].log_name) if name == "log" else Path("a", name)
    pipe.parent.mkdir(exist_ok=True)
    pipe.unlink(missing_ok=True)
    os.mkfifo(pipe)
    ran = tiny("eval", "merge", "a")
    assert ran.status == 2
    assert "not a regular file" in ran.err


def test_link_in_place_of_a_file_of_the_report_is_not_written_through(tiny: CommandLine) -> None:
    Path("own.txt").write_text("mine")
    shard(tiny, "a")
    Path("a", "junit.xml").unlink()
    Path("a", "junit.xml").symlink_to(Path("own.txt").resolve())
    ran = shard(tiny, "a")
    assert (ran.status, Path("own.txt").read_text()) == (75, "mine")
    assert "junit.xml: cannot be written: it is a link; remove it" in ran.err


def test_escapes_of_a_shard_reach_no_terminal(tiny: CommandLine) -> None:
    shard(tiny, "a")
    edit("a", outcome="crashed", reason="\x1b[2J\x9b31m\u202ered")
    ran = tiny("eval", "merge", "a")
    assert ran.status == 1
    assert "\\x1b[2J\\x9b31m\\u202ered" in ran.out
    edit("a", outcome="\x1b[2J\u202e")
    ran = tiny("eval", "merge", "a", "--out", "other")
    assert "x1b[2J" in ran.out
    for text in (ran.out, ran.err):
        assert all(sign.isprintable() or sign == "\n" for sign in text)
