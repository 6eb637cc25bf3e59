"""Each topic and service of both interfaces, with valid and invalid messages: accepted, or refused as a whole."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.middleware.bus import Node
from cellwright.util.errors import RejectedCommandError, ServiceFailedError
from tests.cell.interface.inputs import GEAR, TELEOP, Input, robot, state_hash, whole_cell
from tests.middleware.messages.random_messages import messages, spoiled

SHARED: dict[str, Callable[[], Node]] = {"cell": cache(whole_cell), "robot": cache(robot)}
EACH = [pytest.param("cell", each, id=each.name) for each in GEAR] + [
    pytest.param("robot", each, id=each.name) for each in TELEOP
]


@pytest.mark.slow
@pytest.mark.parametrize(("world", "each"), EACH)
def test_message_is_accepted_or_refused_whole_and_counted(world: str, each: Input) -> None:
    served = SHARED[world]()

    @settings(max_examples=30, print_blob=False)
    @given(st.one_of(messages(each.type_name), spoiled(each.type_name)))
    def try_it(message: Any) -> None:
        before, refused = state_hash(served), served.bus.refusals.total
        try:
            each.give(served.bus, message)
        except RejectedCommandError:
            assert served.bus.refusals.total == refused + 1
            if not each.name.endswith("/goal"):  # a goal that was refused is remembered, as in the original
                assert state_hash(served) == before
        except ServiceFailedError:
            assert state_hash(served) == before
        served.simulation.step()
        assert np.isfinite(served.simulation.data.qpos).all()

    try_it()


@pytest.mark.slow
@pytest.mark.parametrize(("world", "each"), EACH)
@pytest.mark.parametrize("message", [None, "trajectory", 3.5, [], object()], ids=lambda each: type(each).__name__)
def test_object_that_is_not_a_message_is_refused(world: str, each: Input, message: object) -> None:
    served = SHARED[world]()
    before, refused = state_hash(served), served.bus.refusals.total
    with pytest.raises(RejectedCommandError, match="takes"):
        each.give(served.bus, message)
    assert (state_hash(served), served.bus.refusals.total) == (before, refused + 1)
