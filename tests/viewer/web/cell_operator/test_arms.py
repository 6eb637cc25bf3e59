"""Reports of an operator agent, and the arms of a cell, as a page has them."""

from __future__ import annotations

from typing import Any

import pytest

from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose
from cellwright.viewer.web.cell_operator.arms import OperatorState, described_arms
from tests.cell.robot_cells import tandem_cell
from tests.viewer.web.cell_operator.fakes import FakeLink, report, state


def test_report_is_read() -> None:
    found = state(aim=[1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0], mode="moving", note="look", stopped=True)
    assert (found.arm, found.is_stopped, found.has_begun, found.note) == ("arm", True, True, "look")
    arm = found.arms["arm"]
    assert (arm.mode, arm.is_upright, arm.meets_belt) == ("moving", True, False)
    assert arm.aim == Pose((1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    "changed", [{"arms": []}, {"arms": {"arm": {}}}, {"arms": {"arm": None}}, report(aim=[1.0]), report(joints=["x"])]
)
def test_strange_report_is_refused(changed: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match="operator: no report of this version"):
        OperatorState.read({**report(), **changed})


def test_arms_are_those_that_the_cell_describes() -> None:
    assert list(described_arms(FakeLink())) == ["arm"]  # type: ignore[arg-type]
    assert list(described_arms(FakeLink(tandem_cell()))) == ["tandem/right", "tandem/left"]  # type: ignore[arg-type]
