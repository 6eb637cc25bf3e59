"""Commands noted and played into another cell."""

import pytest

from cellwright.bench.played import Command, NotingTransport, play
from cellwright.bench.step import trial_with
from cellwright.cell import Cell
from cellwright.client.client import Client
from cellwright.client.transports.in_process import InProcess
from cellwright.errors import CellwrightError

AHEAD = [2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0]


def worked(cell: Cell) -> list[Command]:
    """What a client did that moves the arm, and is refused once."""
    noting = NotingTransport(InProcess(cell, node="/agent"))
    client = Client(noting)
    client.start_competition()
    client.sleep(0.1)
    client.send_arm([AHEAD], times=[0.2])
    client.sleep(0.1)
    with pytest.raises(CellwrightError):
        client.send_arm([AHEAD], times=[0.2], joints=["no_joint"] * 7)
    client.control_gripper(True)
    client.sleep(0.1)
    client.close()
    return noting.commands


def test_another_cell_comes_to_the_same_state() -> None:
    first, second = Cell(trial_with(4)), Cell(trial_with(4))
    commands = worked(first)
    assert [(each.tick, each.name, each.is_call) for each in commands] == [
        (0, "/ariac/start_competition", True),
        (50, "/ariac/arm/command", False),
        (100, "/ariac/arm/command", False),
        (100, "/ariac/gripper/control", True),
    ]
    play(second, commands, first.simulation.now, node="/agent")
    assert second.simulation.now == first.simulation.now
    assert second.state_hash() == first.state_hash()
    assert not any(topic.subscribers for topic in second.bus.topics() if topic.publishers)


def test_without_the_commands_it_does_not() -> None:
    first, second = Cell(trial_with(4)), Cell(trial_with(4))
    worked(first)
    play(second, [], first.simulation.now, node="/agent")
    assert second.state_hash() != first.state_hash()
