"""Tests of the program of a tracker: its answers, and its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from cellwright.running.evaluation.outputs.trackers import RunOrder, Status, serve

ORDER: dict[str, Any] = {"name": "", "group": "", "parameters": {}}


class Listed:
    """A tracker that lists what it is asked for, and fails at step 2."""

    calls: list[object]

    def begin(self, order: RunOrder) -> str:
        type(self).calls = [order]
        return "run 1"

    def log(self, metrics: Mapping[str, float], step: int) -> None:
        if step == 2:
            raise OSError("no answer")
        self.calls.append((dict(metrics), step))

    def end(self, metrics: Mapping[str, float], step: int, files: Sequence[Path], status: Status) -> None:
        self.calls.append((dict(metrics), step, list(files), status))


def test_password_in_address_is_not_printed() -> None:
    answers: list[dict[str, str]] = []

    class Fails:
        def __init__(self) -> None:
            raise OSError("no answer of http://me:secret@host:5000/api\nat all")

    serve(Fails, iter([{"name": "", "group": "", "parameters": {}}]), answers.append)  # type: ignore[arg-type]
    assert answers == [{"begun": "", "error": "no answer of http://host:5000/api at all"}]


@pytest.mark.parametrize("has_end", [True, False])
def test_failed_update_costs_no_other_and_a_lost_evaluation_is_an_interruption(has_end: bool) -> None:
    answers: list[dict[str, str]] = []
    messages: list[dict[str, Any]] = [ORDER, *({"metrics": {"a": 1.0}, "step": step} for step in (1, 2, 3))]
    if has_end:
        messages.append({"metrics": {"b": 2.0}, "step": 4, "files": ["report.html"], "status": "finished"})
    serve(Listed, iter(messages), answers.append)
    last = ({"b": 2.0}, 4, [Path("report.html")], "finished") if has_end else ({}, 3, [], "interrupted")
    assert Listed.calls == [RunOrder("", "", {}), ({"a": 1.0}, 1), ({"a": 1.0}, 3), last]
    assert answers[0] == {"begun": "run 1", "error": ""}
    assert [each["error"] for each in answers[1:]] == ["", "no answer", "", *([""] if has_end else [])]
