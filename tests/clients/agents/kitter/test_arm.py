"""Positions of the joints."""

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.motion import Joints, forward
from cellwright.util.errors import UsageError
from tests.clients.agents.kitter.places import ARM
from tests.support.cells import ARM_ONLY, BARE


def test_arm_reads_newest_joint_states() -> None:
    cell = Cell(ARM_ONLY)
    client = Client(InProcess(cell))
    arm = KitterArm(client, client, ARM)
    first = arm.joints
    assert arm.tool_time == client.time == 0.02
    assert first == pytest.approx(tuple(Joints.of(client.joint_positions)))
    assert arm.tool == forward(Joints(*first))
    goal = [*first[:-1], first[-1] + 0.5]
    client.send_arm([goal], [0.5], joints=ARM.figures.joints)
    client.sleep(1.0)
    assert arm.joints[-1] == pytest.approx(first[-1] + 0.5, abs=0.02)
    assert arm.tool_time == pytest.approx(client.time, abs=0.02)


def test_arm_without_joint_states_is_refused() -> None:
    client = Client(InProcess(Cell(BARE)))
    with pytest.raises(UsageError, match="no joint positions: nothing is published"):
        KitterArm(client, client, ARM)
