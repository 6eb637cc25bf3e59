"""Keys of a terminal for the arms of a cell."""

from __future__ import annotations

import json
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.keys import FAST, MOVES, SAYS, SPEED, TURN, CellKeys
from cellwright.clients.agents.operator.requests import COMMAND, REPORT, VELOCITY
from cellwright.clients.client.client import Client
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import UsageError
from tests.cell.arm_cells import TWO_UR5, ur5_cell
from tests.support.cells import Ear

ARM = {"mode": "idle", "why": ""}


class Desk:
    """A cell with an agent's report, and the keys of a person."""

    def __init__(self) -> None:
        self.cell = Cell(ur5_cell(TWO_UR5))
        self.report(arm="arm1")
        self.client = Client.in_process(self.cell, node="/operator")
        self.ear = Ear(self.cell, VELOCITY, COMMAND)
        self.cell.simulation.watch("report", Fraction(1), lambda _time: self.report(arm="arm1"))
        self.keys = CellKeys(self.client)

    def report(self, arm: str) -> None:
        state = {"arm": arm, "stopped": False, "note": "", "arms": {"arm1": ARM, "arm2": ARM}}
        self.cell.bus.publish(REPORT, String(json.dumps(state)))

    def type(self, text: str) -> list[Any]:
        """Type text; return what is published then."""
        self.ear.messages.clear()
        assert self.keys.take(text)
        return list(self.ear.messages)


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk()
    yield desk
    desk.client.close()


@pytest.mark.parametrize("key", MOVES)
def test_key_moves_along_its_axis_and_its_capital_is_faster(desk: Desk, key: str) -> None:
    axis, sign = MOVES[key]
    for typed, factor in ((key, 1.0), (key.upper(), FAST)):
        (message,) = desk.type(typed)
        linear, angular = message.twist.linear, message.twist.angular
        values = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
        expected = [0.0] * 6
        expected[axis] = sign * factor * (TURN if axis > 2 else SPEED)
        assert values == pytest.approx(expected)


@pytest.mark.parametrize("key", SAYS)
def test_key_gives_its_command(desk: Desk, key: str) -> None:
    assert [message.data for message in desk.type(key)] == [SAYS[key]]
    assert desk.keys.message == SAYS[key]


def test_stop_precedes_what_was_typed_before_and_repeats_count_once(desk: Desk) -> None:
    stop, *moves = desk.type("www hww")
    assert stop.data == "stop"
    assert [getattr(each, "data", "move") for each in moves] == ["home", "move"]


def test_digit_chooses_an_arm(desk: Desk) -> None:
    assert [message.data for message in desk.type("2")] == ["arm arm2"]
    assert desk.type("3") == []
    assert desk.type("0") == []


def test_suction_of_the_chosen_arm_is_switched(desk: Desk) -> None:
    def enabled() -> list[bool]:
        return [each.enabled for each in desk.cell.grippers.values()]

    desk.type("g")
    assert enabled() == [True, False]
    desk.type("v")
    assert enabled() == [False, False]
    assert desk.keys.message == "release"


def test_escape_and_ctrl_c_quit(desk: Desk) -> None:
    assert desk.keys.take("\x1b")
    assert not desk.keys.take("")
    assert not desk.keys.take("\x03")


def test_loop_draws_and_ends_with_the_key(desk: Desk) -> None:
    typed = iter(["w", "", "", "\x03"])
    drawn: list[str] = []
    desk.keys.run(lambda: next(typed), lambda: drawn.append(desk.keys.report["arm"]))
    assert drawn == ["arm1"]


def test_cell_without_an_operator_is_refused() -> None:
    client = Client.in_process(Cell(ur5_cell(TWO_UR5)))
    with pytest.raises(UsageError, match="no operator works this cell; start it with"):
        CellKeys(client)
    client.close()
