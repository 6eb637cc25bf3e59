"""An agent's stated intention: kept for viewers, bounded, and without effect."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.cell.interface.devices import MAX_INTENTION_LENGTH, Intention
from cellwright.cell.interface.rows import INTENTION
from cellwright.clients.client import Client
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import UnknownNameError
from tests.support.cells import BARE, KITTING, publish, run


@given(st.text(max_size=5 * MAX_INTENTION_LENGTH))
def test_intention_of_any_text_is_one_printable_line(text: str) -> None:
    intention = Intention()
    intention.update(text, "/agent", 7)
    assert len(intention.text) <= MAX_INTENTION_LENGTH
    assert "\n" not in intention.text
    assert intention.text.isprintable()
    assert (intention.node, intention.time) == ("/agent", 7)


def test_long_intention_is_cut() -> None:
    intention = Intention()
    intention.update("x" * 10_000_000, "/agent", 0)
    assert intention.text == "x" * (MAX_INTENTION_LENGTH - 1) + "…"


def test_cell_keeps_newest_intention_until_reset() -> None:
    cell = Cell(KITTING)
    client = Client.in_process(cell, node="/me")
    client.set_status("looking around")
    client.sleep(0.5)
    client.set_status("fetching a gear")
    assert (cell.intention.text, cell.intention.node, cell.intention.time) == ("fetching a gear", "/me", 500_000_000)
    client.close()
    cell.reset()
    assert cell.intention.text == ""


def test_intention_is_not_part_of_state() -> None:
    silent, talking = Cell(KITTING), Cell(KITTING)
    for number in range(5):
        publish(talking, INTENTION, String(f"step {number}"))
        run(talking, 0.05)
        run(silent, 0.05)
    assert talking.state_hash() == silent.state_hash()


def test_set_status_without_topic_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    client = Client.in_process(Cell(BARE))

    def refuse(topic: str, _message: object) -> None:
        raise UnknownNameError("topic", topic, [])

    monkeypatch.setattr(client.transport, "publish", refuse)
    client.set_status("whatever")
