"""Tests of results that are read as they come."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from cellwright.running.evaluation.plan.job import log_name, repeated_key
from cellwright.running.evaluation.results import follow
from cellwright.running.evaluation.results.folder import plan_text
from cellwright.running.evaluation.results.follow import FollowedEvaluation, event_lines, log_of, whole_result
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import share_interval
from cellwright.running.run import versions
from cellwright.util.errors import UsageError
from tests.running.evaluation.made_results import CRASHED, LOST, result, worked

LIMITS = {"wall": 600.0, "memory": 1.0, "log": 1.0}


def line_of(each: Result) -> bytes:
    return each.line + b"\n"


def plan(runs: Sequence[Result], **changes: Any) -> str:
    known = {
        "agent": "my.py:Mine",
        "vary": False,
        "limits": LIMITS,
        "versions": versions(),
        "runs": [{"key": each.key, "trial": each.trial, "seed": each.seed} for each in runs],
    }
    return plan_text(known | changes)


class Folder:
    """Folder of an evaluation that is in progress."""

    def __init__(self, path: Path, runs: Sequence[Result], **changes: Any) -> None:
        self.path, self.file = path, path / "results.jsonl"
        path.mkdir(exist_ok=True, parents=True)
        (path / "plan.json").write_text(plan(runs, **changes), encoding="utf-8")

    def add(self, *content: Result | bytes) -> None:
        with self.file.open("ab") as file:
            for each in content:
                file.write(line_of(each) if isinstance(each, Result) else each)


RUNS = [result(), CRASHED, LOST, worked(seed=4), result(trial="other", seed=1)]


def keys(evaluation: FollowedEvaluation) -> list[str]:
    while evaluation.read():
        pass
    return list(evaluation.rows)


def test_results_come_in_the_order_of_the_plan_and_only_new_bytes_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Folder(tmp_path, RUNS)
    evaluation = FollowedEvaluation([tmp_path])
    assert keys(evaluation) == []
    folder.add(RUNS[3])
    assert keys(evaluation) == ["tiny-4"]
    read: list[object] = []
    from_json = Result.from_json

    def counted(document: object) -> Result:
        read.append(document)
        return from_json(document)

    monkeypatch.setattr(Result, "from_json", counted)
    folder.add(RUNS[0], RUNS[4])
    assert keys(evaluation) == ["tiny-1", "tiny-4", "other-1"]
    assert len(read) == 2
    assert evaluation.counts == {"tiny": 4, "other": 1}
    assert [row.number for row in evaluation.rows.values()] == [2, 1, 3]
    assert evaluation.notices == []


def test_half_line_waits(tmp_path: Path) -> None:
    folder, line = Folder(tmp_path, RUNS), line_of(RUNS[1])
    evaluation = FollowedEvaluation([tmp_path])
    for piece in (line[:1], line[1:100], line[100:-1]):
        folder.add(piece)
        assert keys(evaluation) == []
    folder.add(line[-1:])
    assert keys(evaluation) == ["tiny-2"]
    assert evaluation.notices == []


@pytest.mark.parametrize("chunk", [300, 3000])
def test_file_is_read_in_chunks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, chunk: int) -> None:
    monkeypatch.setattr(follow, "_CHUNK", chunk)
    short = [result(seed=seed) for seed in range(1, 41)]
    assert 300 < len(line_of(short[0])) < 400
    folder = Folder(tmp_path, short)
    folder.add(*short)
    evaluation = FollowedEvaluation([tmp_path])
    if chunk == 300:  # no result is longer than a chunk
        assert keys(evaluation) == []
        assert evaluation.notices
    else:
        evaluation.read()
        assert 0 < len(evaluation.rows) < 10
        assert len(keys(evaluation)) == 40


def test_details_are_read_again_and_figures_need_none(tmp_path: Path) -> None:
    folder = Folder(tmp_path, RUNS)
    folder.add(*RUNS)
    evaluation = FollowedEvaluation([tmp_path])
    assert len(keys(evaluation)) == 5
    rows = evaluation.rows
    assert rows["tiny-2"].result.log == ()
    assert whole_result(rows["tiny-2"]) == CRASHED
    assert share_interval([row.result for row in rows.values()]) == share_interval(RUNS)
    folder.file.write_bytes(folder.file.read_bytes().replace(b"tiny-2", b"tiny-9"))
    with pytest.raises(UsageError, match="the result is no longer there"):
        whole_result(rows["tiny-2"])


def test_equal_runs_stay_known_as_equal(tmp_path: Path) -> None:
    same = [worked(seed=seed) for seed in (1, 2, 3)]
    Folder(tmp_path, same).add(*same)
    evaluation = FollowedEvaluation([tmp_path])
    assert len(keys(evaluation)) == 3
    assert share_interval([row.result for row in evaluation.rows.values()]) is None


def test_foreign_lines_are_a_notice_and_others_count(tmp_path: Path) -> None:
    folder = Folder(tmp_path, RUNS)
    folder.add(b'{"a": 1}\n', b"\xff\xfe\n", b"[" * 100_000 + b"\n", RUNS[0])
    evaluation = FollowedEvaluation([tmp_path])
    assert keys(evaluation) == ["tiny-1"]
    assert evaluation.notices == [f"{folder.file}:1: it has no seal: Cellwright has not written it so"]


def test_removed_file_keeps_its_results_and_another_replaces_them(tmp_path: Path) -> None:
    folder = Folder(tmp_path, RUNS)
    folder.add(RUNS[0], RUNS[1])
    evaluation = FollowedEvaluation([tmp_path])
    assert len(keys(evaluation)) == 2
    os.rename(folder.file, tmp_path / "old.jsonl")
    assert len(keys(evaluation)) == 2
    assert evaluation.notices == [f"{folder.file}: there is none"]
    folder.add(RUNS[2])
    assert keys(evaluation) == ["tiny-3"]
    assert evaluation.notices == []
    folder.file.write_bytes(b"")
    assert keys(evaluation) == []


def test_folder_in_place_of_the_file_is_a_notice(tmp_path: Path) -> None:
    folder = Folder(tmp_path, RUNS)
    folder.file.mkdir()
    evaluation = FollowedEvaluation([tmp_path])
    assert keys(evaluation) == []
    assert evaluation.notices == [f"{folder.file}: cannot be read: not a regular file"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes there")
def test_named_pipe_holds_nothing_up(tmp_path: Path) -> None:
    folder = Folder(tmp_path, RUNS)
    os.mkfifo(folder.file)
    evaluation = FollowedEvaluation([tmp_path])
    assert keys(evaluation) == []


def test_shards_are_one_evaluation_and_the_first_folder_counts(tmp_path: Path) -> None:
    first, second = Folder(tmp_path / "1", RUNS), Folder(tmp_path / "2", RUNS)
    first.add(RUNS[0], RUNS[2])
    second.add(result(1.0), RUNS[1])
    evaluation = FollowedEvaluation([first.path, second.path])
    assert keys(evaluation) == ["tiny-1", "tiny-2", "tiny-3"]
    assert evaluation.rows["tiny-1"].result.points == 12.0
    assert evaluation.rows["tiny-2"].folder == second.path


def test_folder_of_another_plan_is_refused(tmp_path: Path) -> None:
    Folder(tmp_path / "1", RUNS)
    Folder(tmp_path / "2", RUNS[1:])
    Folder(tmp_path / "3", RUNS, limits={"wall": 1.0})
    for other in ("2", "3"):
        with pytest.raises(UsageError, match=f"{other}: does not belong to .*1; give shards of one evaluation"):
            FollowedEvaluation([tmp_path / "1", tmp_path / other])
    shutil.rmtree(tmp_path / "1")
    with pytest.raises(UsageError, match=r"1: it has no plan\.json"):
        FollowedEvaluation([tmp_path / "1"])


def test_results_that_are_not_of_the_plan_or_of_other_limits_do_not_count(tmp_path: Path) -> None:
    lost = result(0.0, seed=3, outcome="wall_limit", limits={**LIMITS, "wall": 5.0})
    folder = Folder(tmp_path, RUNS)
    folder.add(result(seed=77), lost, RUNS[3])
    evaluation = FollowedEvaluation([tmp_path])
    assert keys(evaluation) == ["tiny-4"]
    assert evaluation.done == 1


def test_repetitions_are_done_but_no_rows(tmp_path: Path) -> None:
    again = result(key=repeated_key("tiny-1"))
    folder = Folder(tmp_path, [result(), again])
    folder.add(result(), again)
    evaluation = FollowedEvaluation([tmp_path])
    assert keys(evaluation) == ["tiny-1"]
    assert (evaluation.done, evaluation.counts) == (2, {"tiny": 1})


def test_another_plan_takes_effect_and_a_damaged_one_is_a_notice(tmp_path: Path) -> None:
    folder = Folder(tmp_path, RUNS[:1])
    folder.add(*RUNS)
    evaluation = FollowedEvaluation([tmp_path])
    assert keys(evaluation) == ["tiny-1"]
    (tmp_path / "plan.json").write_text("{", encoding="utf-8")
    assert keys(evaluation) == ["tiny-1"]
    assert "plan.json: not a plan" in evaluation.notices[0]
    Folder(tmp_path, RUNS)
    assert len(keys(evaluation)) == 5
    assert evaluation.notices == []


def test_rate_counts_what_comes_and_not_what_was_there(tmp_path: Path) -> None:
    now = 0.0
    runs = [result(seed=seed) for seed in range(1, 31)]
    folder = Folder(tmp_path, runs)
    folder.add(*runs[:10])
    evaluation = FollowedEvaluation([tmp_path], clock=lambda: now)
    keys(evaluation)
    assert evaluation.rate() is None
    for number in range(10, 20):
        now += 2.0
        folder.add(runs[number])
        keys(evaluation)
    assert evaluation.rate() == pytest.approx(0.5)
    assert evaluation.since_last() == 0.0
    now += 20.0
    keys(evaluation)
    assert evaluation.rate() == pytest.approx(0.25)
    assert evaluation.since_last() == 20.0


def test_log_is_read_from_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Folder(tmp_path, RUNS)
    folder.add(LOST)
    evaluation = FollowedEvaluation([tmp_path])
    keys(evaluation)
    row = evaluation.rows["tiny-3"]
    assert log_of(row, ".log") == []
    log = tmp_path / "logs" / log_name("tiny", 3, "tiny-3")
    log.parent.mkdir()
    log.write_bytes(b"first\n\xffsecond\nlast")
    assert log_of(row, ".log") == ["first", "\N{REPLACEMENT CHARACTER}second", "last"]
    monkeypatch.setattr(follow, "_TAIL", 8)
    assert log_of(row, ".log") == ["last"]


def test_events_have_times_and_words() -> None:
    lines = [
        '{"kind": "run", "trial": "x"}',
        '{"kind": "order", "time": 1.5, "order_id": "order_0", "reason": "time", "kits": {}}',
        '{"kind": "collision", "time": 12, "link": "<b>", "obstacle": "bin7"}',
        '{"kind": "result", "time": 13, "outcome": "done"}',
        '{"kind": "sta',
        "[1]",
        '{"kind": "state", "time": "soon"}',
    ]
    assert list(event_lines(lines)) == ["    1.50 s  order: order_0, time", "   12.00 s  collision: <b>, bin7"]
