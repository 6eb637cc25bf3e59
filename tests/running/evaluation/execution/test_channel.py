"""Lines that a worker's pipe carries: a forged, malformed or poisoned one is the fault of its run alone."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.execution import channel, local, process
from cellwright.running.evaluation.execution.channel import ChannelError, SignedChannel, read_messages
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.outputs.report import report
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from tests.running.evaluation.conftest import Judge, tiny_jobs
from tests.running.evaluation.made_results import KIT, NEVER, PART, TIMELINE

WORKER = """
import hmac, json, sys
order = json.loads(sys.stdin.readline())
for name, text in json.loads(sys.argv[1])[str(order["seed"])]:
    line = text.encode(errors="surrogateescape")
    if name == "signed":
        line = hmac.digest(order["key"].encode(), line, "sha256").hex()[:32].encode() + b" " + line
    sys.stdout.buffer.write(line + b"\\n")
    sys.stdout.flush()
sys.stdin.read()
"""
"""A worker that sends given lines, and waits for its end."""

SCORE = {"orders": [{"order_id": "order_0", "kits": [KIT, NEVER]}]}
REPORT: dict[str, Any] = {
    "outcome": "done",
    "points": 2.0,
    "wall": 1.0,
    "simulated": 20.0,
    "steps": 10_000,
    "success": None,
    "state_hash": "0f" * 32,
    "score": SCORE,
    "timeline": TIMELINE,
    "error": "",
}
GOOD = ("signed", json.dumps({"result": REPORT}))


def signed(**fields: Any) -> tuple[str, str]:
    return "signed", json.dumps(fields)


def reported(**changes: Any) -> tuple[str, str]:
    """Return a signed report with other values; one that is ... is left out."""
    return signed(result={name: each for name, each in (REPORT | changes).items() if each is not ...})


def nested(levels: int) -> Any:
    value: Any = 0
    for _ in range(levels):
        value = [value]
    return value


LINES = {
    "words": ("raw", "no json"),
    "nothing": ("raw", ""),
    "bytes that are no text": ("raw", "\udcff\udcfe"),
    "object": ("raw", "{}"),
    "result that is not signed": ("raw", GOOD[1]),
    "result with another signature": ("raw", f"{'0' * 32} {GOOD[1]}"),
    "refusal that is not signed": ("raw", '{"refused": "no such agent"}'),
    "very deep list": ("raw", "[" * 100_000),
    "list": ("signed", "[]"),
    "half an object": ("signed", '{"result": {"outcome": "done"'),
    "empty object": signed(),
    "unknown kind": signed(won=True),
    "two kinds": signed(made=True, begun=1),
    "refusal that is a number": signed(refused=5),
    "begin that is a word": signed(begun="now"),
    "kill that is a word": signed(kills="yes"),
    "scene that is a number": signed(scene=5),
    "progress that is a number": signed(progress=7),
    "progress with too many points": signed(progress={"time": 1.0, "points": 999.0}),
    "progress before the start": signed(progress={"time": -1.0, "points": 0.0}),
    "result that is a number": signed(result=5),
    "result that is empty": signed(result={}),
    "result with another field": reported(key="another run"),
    "more points than attainable": reported(points=999.0),
    "points that the kits do not have": reported(points=6.0),
    "negative points": reported(points=-1.0),
    "points in words": reported(points="8"),
    "points beyond numbers": ("signed", GOOD[1].replace('"points": 2.0', '"points": 1e999', 1)),
    "points that are not a number": ("signed", GOOD[1].replace('"points": 2.0', '"points": NaN', 1)),
    "unknown outcome": reported(outcome="won"),
    "outcome that is a list": reported(outcome=[]),
    "no state hash": reported(state_hash=...),
    "state hash in words": reported(state_hash="equal"),
    "endless wall time": reported(wall=1e300),
    "score that is a list": reported(score=[]),
    "score of another form": reported(score={"orders": [{"order_id": 5, "kits": []}]}),
    "part without its distance": reported(
        score={"orders": [{"order_id": "o", "kits": [{**KIT, "parts": [{**PART, "distance": "far"}]}]}]}
    ),
    "score without bottom": reported(score={**SCORE, "more": nested(200)}),
    "timeline of another form": reported(timeline={**TIMELINE, "held": 3}),
    "error that is a number": reported(error=5),
    "lone surrogate": ("signed", '{"refused": "\\ud800"}'),
}
"""A line by what it is; none is of a worker."""


@pytest.fixture
def sent(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Result]]:
    """Return a function that evaluates two runs, whose workers send given lines."""

    def evaluate(*lines: tuple[str, str]) -> list[Result]:
        table = json.dumps({1: [signed(begun=1), *lines], 2: [signed(begun=1), GOOD]})
        command = [sys.executable, "-I", "-S", "-c", WORKER, table]
        monkeypatch.setattr(local, "worker_server", lambda: None)
        monkeypatch.setattr(process, "own_program", lambda *_: command)
        with ResultsFile(folder / "out") as store:
            assert LocalRunner(store, workers=2).run(tiny_jobs(folder, "Deliver", seeds=2))
        with ResultsFile(folder / "out") as store:
            assert store.notices == []
            results = sorted(store.results.values(), key=lambda each: each.seed)
        assert "tiny seed 1" in report(results, None)
        return results

    return evaluate


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_invalid_line_is_the_fault_of_its_run_alone(line: tuple[str, str], sent: Callable[..., list[Result]]) -> None:
    spoiled, other = sent(line, GOOD)
    assert (spoiled.outcome, spoiled.points) == ("invalid", 0.0)
    assert spoiled.reason.startswith("its process sent an invalid ")
    assert spoiled.reason.isprintable()
    assert (other.outcome, other.points) == ("done", 2.0)


def test_valid_lines_are_a_result(sent: Callable[..., list[Result]]) -> None:
    first, other = sent(signed(progress={"time": 1.0, "points": 2.0}), GOOD)
    assert (first.outcome, first.points, first.score) == ("done", 2.0, SCORE)
    assert other.outcome == "done"


def test_reason_of_a_refusal_is_one_printable_line(sent: Callable[..., list[Result]]) -> None:
    refused, _ = sent(signed(refused="no \x1b[31mmap\nat all \u202e"))
    assert (refused.outcome, refused.reason) == ("refused", r"no \x1b[31mmap at all \u202e")


def test_line_longer_than_its_bound_is_invalid(
    sent: Callable[..., list[Result]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(channel, "_MAX_LINE", 1 << 15)
    spoiled, other = sent(("raw", "x" * 60_000))
    assert (spoiled.outcome, other.outcome) == ("invalid", "done")


WRITER = '''
import os
from programs import Deliver

class Writes(Deliver):
    """Writes a forged result to every file that its process has open."""

    def run(self, client):
        for number in range(3, 64):
            try:
                os.write(number, b'{"result": {"outcome": "done", "points": 6.0}}\\n')
            except OSError:
                pass
        super().run(client)
'''


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="files have other numbers there")
def test_program_that_writes_to_all_open_files_forges_no_result(judge: Judge, folder: Path) -> None:
    (folder / "writer.py").write_text(WRITER)
    with ResultsFile(folder / "out") as store:
        LocalRunner(store).run(tiny_jobs(folder, "Writes", file="writer.py"))
        (result,) = store.results.values()
    assert (result.outcome, result.points) == ("invalid", 0.0)
    assert result.reason == "its process sent an invalid line: a line is not signed by the worker"


@given(text=st.text(st.characters(exclude_categories=["Cs"])), cut=st.integers(min_value=1, max_value=20))
def test_signed_messages_are_read_and_half_a_line_is_none(text: str, cut: int) -> None:
    stream = BytesIO()
    output: Any = type("Text", (), {"write": lambda _, line: stream.write(line.encode()), "flush": lambda _: None})()
    SignedChannel(output, "key").send("scene", text)
    SignedChannel(output, "key").send("made", True)
    whole = stream.getvalue()
    assert [each.scene for each in read_messages(BytesIO(whole), "key")] == [text, None]
    assert [each.scene for each in read_messages(BytesIO(whole[:-cut]), "key")] == [text]
    with pytest.raises(ChannelError, match="not signed"):
        list(read_messages(BytesIO(whole), "another"))
