"""Tests of the result service during a run: the secrets of a competition stay secret until it is over."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.cli.serve import RESULT, offer_result
from cellwright.running.run import ServerOptions, Session
from tests.support.cells import KITTING, call, order

TRIAL = replace(KITTING, orders=(order(), order(1, start_time=100.0)), faulty_parts=frozenset({"gear_part_2"}))
TRIAL = replace(TRIAL, overrides=("faulty_parts=[gear_part_2]",))


def answer_of(monkeypatch: pytest.MonkeyPatch, *services: str, competition: bool = True) -> dict[str, Any]:
    """Return the service's answer 0.2 s after the cell began, with these services called."""
    cell = Cell(TRIAL, seed=7, competition=competition)

    def begin(_session: Session) -> None:
        for service in services:
            assert call(cell, service).success
            cell.step()

    answers: dict[str, Any] = {}
    with Session(cell, serve=ServerOptions(port=0, on_ready=begin)) as session:
        assert session.server is not None
        monkeypatch.setattr(session.server, "offer", answers.__setitem__)
        offer_result(session)
        session.run(until=0.2)
    answer: dict[str, Any] = answers[RESULT]({})
    return answer


def test_result_of_running_competition_hides_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    answer = answer_of(monkeypatch, "start_competition")
    document = answer["document"]
    assert (document["competition_state"], document["seed"], document["circumstances"]) == ("go", None, None)
    assert document["overrides"] is None
    assert (document["score"]["reachable"], document["score"]["best"]) == (6.0, 6.0)
    assert "order_1" not in str(answer)
    assert "of 6 points" in answer["text"]


@pytest.mark.parametrize("competition", [True, False])
def test_result_after_competition_or_in_development_is_complete(
    competition: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = answer_of(monkeypatch, "start_competition", *["end_competition"] * competition, competition=competition)
    document = answer["document"]
    assert document["seed"] == 7
    assert document["circumstances"] is not None
    assert document["overrides"] == ["faulty_parts=[gear_part_2]"]
    assert (document["score"]["reachable"], document["score"]["best"]) == (4.0, 12.0)
    assert "order_1" in answer["text"]
