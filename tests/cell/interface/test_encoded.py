"""Publications without message objects: their bytes are those of the messages."""

from __future__ import annotations

from functools import partial

import pytest

from cellwright.cell.cell import Cell
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.middleware.messages import Message
from tests.support.cells import INITIAL, WHOLE, publish, run, start, way

AHEAD = (0.2, *INITIAL[1:])


def heard(trial: Trial, *, is_encoded: bool, seconds: float, arms: bool) -> tuple[dict[str, list[bytes]], int]:
    """Return the bytes of all topics of a run, and how many came without a message."""
    cell, found, directly = Cell(trial), {}, [0]

    def take(into: list[bytes], data: bytes) -> None:
        into.append(data)
        directly[0] += 1

    def hear(into: list[bytes], message: Message) -> None:
        into.append(cell.bus.types.to_cdr(message))

    for name in cell.topics():
        if "image" not in name and "depth" not in name:
            into = found[name] = list[bytes]()
            cell.bus.subscribe(name, partial(hear, into), take_cdr=partial(take, into) if is_encoded else None)
    start(cell)
    if arms:
        publish(cell, "arm/command", way(AHEAD))
    run(cell, seconds)
    return found, directly[0]


@pytest.mark.slow
def test_bytes_of_each_topic_are_those_of_its_messages() -> None:
    directly, count = heard(WHOLE, is_encoded=True, seconds=1.2, arms=True)
    by_message, none = heard(WHOLE, is_encoded=False, seconds=1.2, arms=True)
    assert directly == by_message
    assert none == 0
    assert count > 0.9 * sum(map(len, directly.values()))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["final01", "bimanual_reach"])
def test_bytes_of_other_cells_are_those_of_their_messages(name: str) -> None:
    trial = load_trial([find_trial(name)]).trial
    directly, _ = heard(trial, is_encoded=True, seconds=0.3, arms=False)
    by_message, _ = heard(trial, is_encoded=False, seconds=0.3, arms=False)
    assert directly == by_message
