"""Identities: names of nodes, and the parameters of each kind of node at the master."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.interface.rows import SIMULATOR
from cellwright.middleware.ros1.identity import node_name
from cellwright.robot.interface import robot_identity
from cellwright.util.errors import UsageError

ACCEPTED = re.compile(r"/[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*")


@pytest.mark.parametrize("name", ["openloong_controller_node", "/openloong_controller_node"])
def test_node_name_without_slash_gets_one(name: str) -> None:
    assert robot_identity(name).node == "/openloong_controller_node"


def test_robot_uses_wall_time_by_default() -> None:
    assert not robot_identity("a").tells_time
    assert robot_identity("a", sim_time=True).tells_time
    assert not robot_identity("a", sim_time=True).frame_source
    assert SIMULATOR.tells_time
    assert SIMULATOR.frame_source


@pytest.mark.parametrize("name", ["", "/", "2arms", "left arm", "a//b", "a/", "~own", "roboter_ä", "a\n", "a" * 300])
def test_invalid_node_name_is_refused(name: str) -> None:
    with pytest.raises(UsageError, match="is not a node name"):
        node_name(name)


@given(st.text(max_size=30))
def test_random_node_name_becomes_absolute_or_is_refused(text: str) -> None:
    try:
        name = node_name(text)
    except UsageError:
        return
    assert ACCEPTED.fullmatch(name)
    assert name in (text, f"/{text}")
