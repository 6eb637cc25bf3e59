"""Topics for recordings alone: their messages have a bound, and no effect."""

import pytest

from cellwright import Cell, load_robot
from cellwright.middleware.interface.notes import MAX_LENGTH
from cellwright.middleware.messages.standard import String
from cellwright.robot.node import RobotNode
from cellwright.util.errors import RejectedCommandError
from tests.support.cells import BARE

TOPIC = "/cellwright/policy"


def test_cell_and_node_take_reports_without_effect() -> None:
    for make in (lambda: Cell(BARE), lambda: RobotNode(load_robot("tandem"))):
        node, other = make(), make()
        node.bus.publish(TOPIC, String("{}"))
        node.simulation.step_until(100_000_000)
        other.simulation.step_until(100_000_000)
        assert node.simulation.state_hash() == other.simulation.state_hash()


def test_report_that_is_too_long_is_refused() -> None:
    node = RobotNode(load_robot("tandem"))
    with pytest.raises(RejectedCommandError, match=r"policy: from /op: at most 2097152 characters \(got 2097153\)"):
        node.bus.publish(TOPIC, String("x" * (MAX_LENGTH + 1)), node="/op")
