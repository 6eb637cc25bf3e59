"""The ROS parameters of a robot's controller node."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import xmlrpc.client

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.robot.interface import ros_parameters

URDF = '<?xml version="1.0"?><robot name="two arms"><link name="base"/></robot>'


def test_the_urdf_lies_under_the_name_of_the_node() -> None:
    assert ros_parameters(URDF, node="/cell_2/robot", sim_time=False) == {"cell_2/robot": {"robot_description": URDF}}


def test_without_a_urdf_there_is_nothing() -> None:
    assert ros_parameters("", node="/robot", sim_time=False) == {}


def test_only_who_tells_the_time_says_that_it_is_simulated() -> None:
    assert ros_parameters("", node="/robot", sim_time=True) == {"use_sim_time": True}


@pytest.mark.parametrize("stray", ["\x1a", "\0", "\x0b", "\uffff", "\ud800"])
def test_stray_characters_are_left_out(stray: str) -> None:
    """A vendor's file has a 0x1A in a comment."""
    found = ros_parameters(URDF.replace("<link", f"{stray}<link"), node="/robot", sim_time=False)
    assert found["robot"]["robot_description"] == URDF


@given(st.text())
def test_a_master_accepts_the_urdf_of_any_file(text: str) -> None:
    (kept,) = ros_parameters(f"x{text}", node="/robot", sim_time=False)["robot"].values()
    sent = xmlrpc.client.dumps((kept,), "setParam").encode()
    ((came,), _) = xmlrpc.client.loads(sent)
    assert came == ET.fromstring(f"<a>{kept.replace('&', '&amp;').replace('<', '&lt;')}</a>").text
