"""Tests of the result of a run."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.running.run import Outcome, Session, versions
from tests.running.run.test_cells import work
from tests.support.cells import BARE


def test_result_is_frozen() -> None:
    result = Session(BARE).run(until=0.1)
    with pytest.raises(FrozenInstanceError):
        result.error = "none"  # type: ignore[misc]


def test_trial_without_orders_ends_at_once_and_is_not_done() -> None:
    def wait(client: Client) -> None:
        client.start_competition()
        client.wait_until(lambda: client.competition_state == "done")

    result = work(wait, Cell(BARE))
    assert result.outcome is Outcome.NO_ORDER
    assert result.simulated == pytest.approx(0.1)


def test_versions_name_all_dependencies() -> None:
    assert {"cellwright", "mujoco", "numpy", "python", "platform"} == versions().keys()
    assert all(versions().values())
